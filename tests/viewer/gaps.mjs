// Counts the pixels of a page that show what is behind the whole scene: those that change with the clear color, be it a little.

import { settle } from "./browser.mjs";

/** Has the page clear its canvas with `window.behind`, and keeps what was drawn until somebody reads it. */
export const clearColorScript = `
    window.behind = [1, 0, 1, 1];
    window.clears = 0;
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, attributes) {
        return getContext.call(this, kind, { ...attributes, preserveDrawingBuffer: true });
    };
    const { clear } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.clear = function (buffers) {
        const color = this.getParameter(this.COLOR_CLEAR_VALUE);
        if (buffers & this.COLOR_BUFFER_BIT && color[3] === 1) {
            window.clears += 1;
            this.clearColor(...window.behind);
        }
        clear.call(this, buffers);
        this.clearColor(...color);
    };`;

/** From the middle to all edges and corners, and as far as the wheel goes. */
export const places = [
    { right: 0, up: 0 },
    ...[-1, 0, 1].flatMap((right) => [-1, 0, 1].map((up) => ({ right, up }))).filter(({ right, up }) => right !== 0 || up !== 0),
    ...[-1600, 1600].flatMap((wheel) => [-1, 0, 1].map((right) => ({ right, up: 0, wheel }))),
];

/** Takes the viewer to a place. The page was opened with reduced motion, where a mouse drags and nothing eases. */
export async function goTo(page, { right, up, wheel = 0 }) {
    await page.keyboard.press("Home");
    const { x, y, width, height } = await page.locator("#frame").boundingBox();
    const [middleX, middleY] = [x + width / 2, y + height / 2];
    await page.mouse.move(middleX, middleY);
    if (right !== 0 || up !== 0) {
        await page.mouse.down();
        await page.mouse.move(middleX - 0.4 * width * right, middleY + 0.4 * width * up); // a drag of 0.4 widths goes as far as one should
        await page.mouse.up();
    }
    if (wheel !== 0) await page.mouse.wheel(0, wheel);
    return settle(page);
}

/**
 * The number of pixels of the canvas that change with the clear color.
 *
 * @param {boolean} hasBackdrop
 */
export function countGaps(page, hasBackdrop) {
    return page.evaluate(async (hasBackdrop) => {
        const gl = document.getElementById("view").getContext("webgl2");
        const drawn = async (behind) => {
            window.behind = behind;
            const before = window.clears;
            window.viewer.setBackdrop(hasBackdrop);
            while (window.clears === before) await new Promise(requestAnimationFrame);
            const pixels = new Uint32Array(gl.drawingBufferWidth * gl.drawingBufferHeight);
            gl.bindFramebuffer(gl.FRAMEBUFFER, null);
            gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(pixels.buffer));
            return pixels;
        };
        const green = await drawn([0, 1, 0, 1]);
        const magenta = await drawn([1, 0, 1, 1]);
        return magenta.reduce((count, color, i) => count + (color !== green[i]), 0);
    }, hasBackdrop);
}
