// The part of the frame that the canvas shows: all of it, a part that covers a canvas of another shape, or a magnified part. This module is
// independent of the page and of three.js. Positions in the frame are -1 to 1 from left to right and from bottom to top.

const maxZoom = 6;
const nothing = 1e-4;

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

export class Pane {
    constructor() {
        /** Visible share of the frame's width and height at zoom 1. */
        this.covered = { x: 1, y: 1 };
        /** Horizontal position in the frame at which a canvas narrower than the frame is centered. */
        this.interest = 0;
        this.target = { zoom: 1, x: 0, y: 0 };
        this.now = { zoom: 1, x: 0, y: 0 };
    }

    /** Fits the frame to a canvas of this shape. Crops a frame that is too wide or too high for the canvas. */
    fit(frameAspect, canvasAspect) {
        const { zoom, x, y } = this.home;
        const isHome = (part) => part.zoom === zoom && part.x === x && part.y === y;
        const [aimsHome, isAtHome] = [isHome(this.target), isHome(this.now)];
        this.covered = { x: Math.min(canvasAspect / frameAspect, 1), y: Math.min(frameAspect / canvasAspect, 1) };
        this.target = aimsHome ? this.home : this.limited(this.target);
        this.now = isAtHome ? this.home : this.limited(this.now);
    }

    /** The part of the frame that the canvas shows without magnification. */
    get home() {
        return this.limited({ zoom: 1, x: this.interest, y: 0 });
    }

    /** Moves back to the home over the next pictures. */
    reset() {
        this.target = this.home;
    }

    /** Jumps to the home, for another photo. */
    restart() {
        this.target = this.now = this.home;
    }

    /** Returns the visible share of the frame's width and height at this zoom. */
    half({ zoom }) {
        return { x: this.covered.x / zoom, y: this.covered.y / zoom };
    }

    /** Limits a magnification and a position so that the canvas shows nothing beyond the frame's edges. */
    limited({ zoom, x, y }) {
        const magnified = clamp(zoom, 1, maxZoom);
        const half = this.half({ zoom: magnified });
        return { zoom: magnified, x: clamp(x, half.x - 1, 1 - half.x), y: clamp(y, half.y - 1, 1 - half.y) };
    }

    /**
     * Magnifies around a fixed point of the canvas.
     *
     * @param {number} factor
     * @param {number} right  position in the canvas, -1 to 1
     * @param {number} up
     */
    zoomAt(factor, right, up) {
        const { zoom, x, y } = this.target;
        const before = this.half(this.target);
        const magnified = clamp(zoom * factor, 1, maxZoom);
        const after = this.half({ zoom: magnified });
        this.target = this.limited({ zoom: magnified, x: x + right * (before.x - after.x), y: y + up * (before.y - after.y) });
    }

    /** Pans by shares of half the canvas. Moves without easing, because the picture must follow the finger. */
    pan(right, up) {
        const half = this.half(this.target);
        this.target = this.limited({ ...this.target, x: this.target.x + right * half.x, y: this.target.y + up * half.y });
        Object.assign(this.now, { x: this.target.x, y: this.target.y });
    }

    /** Forward motion that accompanies the magnification, 0 to 1. */
    get forward() {
        return Math.min(Math.log2(this.target.zoom), 1);
    }

    /** Moves toward the target. @param {number} share  of the way to the target @returns {boolean} whether the visible part has changed */
    advance(share) {
        let hasMoved = false;
        for (const axis of ["zoom", "x", "y"]) {
            const way = this.target[axis] - this.now[axis];
            if (way === 0) continue;
            hasMoved = true;
            this.now[axis] = Math.abs(way) < nothing ? this.target[axis] : this.now[axis] + share * way;
        }
        return hasMoved;
    }

    /** Returns the edges of the visible part, in positions of the frame. */
    get edges() {
        const half = this.half(this.now);
        const { x, y } = this.now;
        return { left: x - half.x, right: x + half.x, bottom: y - half.y, top: y + half.y };
    }
}
