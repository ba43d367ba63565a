// Counts the pixels of a page that show what is behind the whole scene: those that change with the clear color, be it a little.

import { settle } from "./browser.mjs";

/** Has the page clear what it shows with `window.behind`. */
export const clearColorScript = `
    window.behind = [1, 0, 1, 1];
    const { clear } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.clear = function (buffers) {
        const color = this.getParameter(this.COLOR_CLEAR_VALUE);
        const isShown = this.getParameter(this.FRAMEBUFFER_BINDING) === null || window.emulated?.activeSession;
        if (buffers & this.COLOR_BUFFER_BIT && isShown) this.clearColor(...window.behind);
        clear.call(this, buffers);
        this.clearColor(...color);
    };`;

/** From the middle to all edges and corners, and as far as the viewer may go in and back. */
export const places = [
    { right: 0, up: 0 },
    ...[-1, 0, 1].flatMap((right) => [-1, 0, 1].map((up) => ({ right, up }))).filter(({ right, up }) => right !== 0 || up !== 0),
    ...[-1, 1].flatMap((forward) => [-1, 0, 1].map((right) => ({ right, up: 0, forward }))),
];

/** Takes the viewer to a place. */
export async function goTo(page, place) {
    await page.evaluate((place) => document.querySelector("photo-3d").lookFrom(place), place);
    return settle(page);
}

/**
 * The number of pixels of the canvas that change with the clear color.
 *
 * @param {boolean} hasBackdrop
 */
export function countGaps(page, hasBackdrop) {
    return page.evaluate(async (hasBackdrop) => {
        const shown = document.querySelector("photo-3d");
        const drawn = async (behind) => {
            window.behind = behind;
            const before = shown.constructor.statistics().drawings;
            shown.setBackdrop(hasBackdrop);
            while (shown.constructor.statistics().drawings === before) await new Promise(requestAnimationFrame);
            const { width, height } = shown.canvas;
            return new Uint32Array(shown.canvas.getContext("2d").getImageData(0, 0, width, height).data.buffer);
        };
        const green = await drawn([0, 1, 0, 1]);
        const magenta = await drawn([1, 0, 1, 1]);
        return magenta.reduce((count, color, i) => count + (color !== green[i]), 0);
    }, hasBackdrop);
}
