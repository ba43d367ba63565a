// Counts the pixels of a page that show the clear color behind the scene: all pixels that change, even slightly, with the clear color.

import { settle } from "./browser.mjs";

/** Makes the page clear its canvas with the color `window.behind`, and preserve a headset's pictures until a test reads them. */
export const clearColorScript = `
    window.behind = [1, 0, 1, 1];
    window.clears = 0;
    const getAnyContext = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, attributes) {
        if (kind !== "webgl2") return getAnyContext.call(this, kind, attributes);
        return (window.gl = getAnyContext.call(this, kind, { ...attributes, preserveDrawingBuffer: true }));
    };
    const { clear } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.clear = function (buffers) {
        const color = this.getParameter(this.COLOR_CLEAR_VALUE);
        const isShown = this.getParameter(this.FRAMEBUFFER_BINDING) === null || window.emulated?.activeSession;
        if (buffers & this.COLOR_BUFFER_BIT && isShown) {
            this.clearColor(...window.behind);
            window.clears += 1;
        }
        clear.call(this, buffers);
        this.clearColor(...color);
    };`;

/** Positions of the viewer: the center, all edges and corners, and the limits forward and back. */
export const places = [
    { right: 0, up: 0 },
    ...[-1, 0, 1].flatMap((right) => [-1, 0, 1].map((up) => ({ right, up }))).filter(({ right, up }) => right !== 0 || up !== 0),
    ...[-1, 1].flatMap((forward) => [-1, 0, 1].map((right) => ({ right, up: 0, forward }))),
];

/** Moves the viewer to a position. */
export async function goTo(page, place) {
    await page.evaluate((place) => document.querySelector("photo-3d").lookFrom(place), place);
    return settle(page);
}

/**
 * Returns the number of pixels of the canvas, or of both eyes' pictures, that change with the clear color.
 *
 * @param {boolean} hasBackdrop
 */
export function countGaps(page, hasBackdrop) {
    return page.evaluate(async (hasBackdrop) => {
        const shown = document.querySelector("photo-3d");
        const drawn = async (behind) => {
            window.behind = behind;
            const before = window.clears;
            shown.setBackdrop(hasBackdrop);
            while (window.clears === before) await new Promise(requestAnimationFrame);
            if (!shown.state().isInHeadset) {
                const { width, height } = shown.canvas;
                return new Uint32Array(shown.canvas.getContext("2d").getImageData(0, 0, width, height).data.buffer);
            }
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
