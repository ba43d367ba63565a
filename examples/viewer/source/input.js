// Forwards mouse, touch, wheel and keys to the motion and to the pane. In a page with other content, the page handles the wheel, vertical
// drags and two fingers; a full-screen photo handles all of them.

/** @typedef {import("./motion.js").Motion} Motion */
/** @typedef {import("./pane.js").Pane} Pane */

/** A drag over this share of the photo's width reaches the motion limit. */
const dragShare = 0.4;

/** Vertical wheel distance, in pixels, that doubles the zoom. */
const wheelPixels = 400;

/**
 * Two taps within this time and distance are a double tap, which magnifies by `zoom`. A finger that moves more than `moved` pixels is not a
 * tap.
 */
const doubleTap = { milliseconds: 300, pixels: 30, moved: 8, zoom: 2.5 };

const keySteps = {
    ArrowRight: ({ motion }) => motion.drag(0.2, 0),
    ArrowLeft: ({ motion }) => motion.drag(-0.2, 0),
    ArrowUp: ({ motion }) => motion.drag(0, 0.2),
    ArrowDown: ({ motion }) => motion.drag(0, -0.2),
    "+": (input) => input.zoom(1.25, 0, 0),
    "=": (input) => input.zoom(1.25, 0, 0), // plus, without shift
    "-": (input) => input.zoom(0.8, 0, 0),
    Home: (input) => input.reset(),
    0: (input) => input.reset(),
};
const keyStepsAlone = { PageDown: (input) => input.zoom(0.5, 0, 0), PageUp: (input) => input.zoom(2, 0, 0) };

export class Input {
    /**
     * @param {object} parts
     * @param {HTMLElement} parts.photo  the element that shows the photo
     * @param {Motion} parts.motion
     * @param {Pane} parts.pane
     * @param {() => boolean} parts.isAlone  whether the photo fills the screen
     * @param {() => void} parts.changed  called after every input
     * @param {() => void} parts.used  called after an input that looks around or zooms, but not if the page scrolled instead
     */
    constructor({ photo, motion, pane, isAlone, changed, used }) {
        Object.assign(this, { photo, motion, pane, isAlone, changed, used });
        /** Positions of fingers and of a pressed mouse, by pointer id. @type {Map<number, {x: number, y: number}>} */
        this.held = new Map();
        /** Distance of the current drag, in pixels. */
        this.dragged = 0;
        this.lastTap = { time: -Infinity, x: 0, y: 0 };
    }

    zoom(factor, right, up) {
        this.motion.lead();
        this.pane.zoomAt(factor, right, up);
        this.motion.approach(this.pane.forward);
    }

    reset() {
        this.motion.reset();
        this.pane.reset();
    }

    /** Returns an event's position in the photo, -1 to 1 from left to right and from bottom to top. */
    placeOf({ clientX, clientY }) {
        const { left, top, width, height } = this.photo.getBoundingClientRect();
        return [(2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height];
    }

    /** @param {HTMLElement} area  area of pointer input */
    listen(area) {
        area.addEventListener("pointermove", (event) => this.pointerMoved(event));
        area.addEventListener("pointerdown", (event) => this.pointerPressed(event));
        area.addEventListener("pointerup", (event) => this.pointerLifted(event));
        area.addEventListener("pointercancel", (event) => {
            this.dragged = 0; // the page scrolls instead
            this.pointerLifted(event);
        });
        area.addEventListener("pointerleave", (event) => {
            if (event.pointerType !== "mouse" || this.held.size > 0) return;
            this.motion.leave();
            this.changed();
        });
        this.area = area;
        this.wheel = (event) => {
            event.preventDefault();
            const unit = [1, 40, 800][event.deltaMode]; // pixels, lines, pages
            this.zoom(2 ** ((-event.deltaY * unit) / wheelPixels), ...this.placeOf(event));
            this.changed();
            this.used();
        };
    }

    /** Listens to the wheel only for a full-screen photo. In a page, a listener that can cancel wheel events would slow scrolling. */
    setAlone(isAlone) {
        this.area.removeEventListener("wheel", this.wheel);
        if (isAlone) this.area.addEventListener("wheel", this.wheel, { passive: false });
    }

    /**
     * A mouse looks around by its position. A finger drags the scene: near surfaces follow it, so the viewer moves in the opposite
     * direction. With reduced motion, the mouse also drags, because the picture must not move without a press.
     */
    pointerMoved(event) {
        const before = this.held.get(event.pointerId);
        if (before) {
            const now = { x: event.clientX, y: event.clientY };
            const others = [...this.held.values()].filter((place) => place !== before);
            this.held.set(event.pointerId, now);
            this.dragged += Math.hypot(now.x - before.x, now.y - before.y);
            if (Math.hypot(now.x - this.lastTap.x, now.y - this.lastTap.y) > doubleTap.moved) this.forgetTap();
            if (others.length === 1) this.pinch(before, now, others[0]);
            if (others.length === 0) this.drag(now.x - before.x, before.y - now.y);
            this.changed();
        } else if (event.pointerType === "mouse" && !this.motion.isReduced()) {
            this.motion.hover(...this.placeOf(event));
            this.changed();
            this.used();
        }
    }

    /** @param {number} right  motion of the pointer in pixels @param {number} up */
    drag(right, up) {
        const { clientWidth, clientHeight } = this.photo;
        const scale = dragShare * clientWidth;
        this.motion.drag(-right / scale, -up / scale);
        this.pane.pan((-2 * right) / clientWidth, (-2 * up) / clientHeight);
    }

    pinch(before, now, other) {
        const length = (place) => Math.max(Math.hypot(place.x - other.x, place.y - other.y), 1);
        const middle = { clientX: (now.x + other.x) / 2, clientY: (now.y + other.y) / 2 };
        this.zoom(length(now) / length(before), ...this.placeOf(middle));
        const { clientWidth, clientHeight } = this.photo;
        this.pane.pan((before.x - now.x) / clientWidth, (now.y - before.y) / clientHeight);
    }

    pointerPressed(event) {
        const isMouse = event.pointerType === "mouse";
        if (event.button !== 0 || event.composedPath().some((part) => part.localName === "button")) return;
        if (this.held.size === 0) this.findDoubleTap(event);
        else this.forgetTap();
        const canDrag = !isMouse || this.motion.isReduced() || this.pane.target.zoom > 1;
        if (!canDrag || (this.held.size > 0 && !this.isAlone())) return;
        if (this.held.size === 0) this.dragged = 0;
        this.held.set(event.pointerId, { x: event.clientX, y: event.clientY });
        this.photo.setPointerCapture(event.pointerId);
        this.motion.lead(); // the first touch stops the sway
        this.changed();
    }

    pointerLifted(event) {
        if (!this.held.delete(event.pointerId) || this.held.size > 0) return;
        if (event.pointerType !== "mouse") this.motion.leave();
        this.changed();
        if (this.dragged > doubleTap.moved) this.used();
    }

    /** Detects a double tap. The first double tap magnifies around its position; the next resets the magnification. */
    findDoubleTap({ timeStamp, clientX, clientY }) {
        const { time, x, y } = this.lastTap;
        const isSecond = timeStamp - time < doubleTap.milliseconds && Math.hypot(clientX - x, clientY - y) < doubleTap.pixels;
        this.lastTap = { time: isSecond ? -Infinity : timeStamp, x: clientX, y: clientY };
        if (!isSecond || !this.isAlone()) return;
        if (this.pane.target.zoom > 1) this.reset();
        else this.zoom(doubleTap.zoom, ...this.placeOf({ clientX, clientY }));
        this.changed();
        this.used();
    }

    forgetTap() {
        this.lastTap.time = -Infinity;
    }

    /** @param {string} key @returns {boolean} whether the key has a function */
    keyPressed(key) {
        const step = keySteps[key] ?? (this.isAlone() ? keyStepsAlone[key] : undefined);
        if (!step) return false;
        step(this);
        this.changed();
        this.used();
        return true;
    }
}
