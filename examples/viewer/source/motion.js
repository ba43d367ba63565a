// Position of the viewer: the sum of the motions from mouse, device, scrolling, dragging and keys, limited and eased. Independent of the
// page, three.js and the photo: all values are in the units of Reach (frame.js), where 1 is the limit of the motion.

/** @typedef {import("./frame.js").Reach} Reach */

/** Seconds in which the viewer covers two thirds of the way to where they should be. */
const easeSeconds = 0.12;

/** Less than this is not seen. */
const nothing = 1e-3;

/** Dragging goes on beyond 1, ever more slowly, and never beyond this. */
const dragLimit = 1.6;

/** What scrolling from the middle to one end does. */
const scrollReach = { right: 0.15, up: 0.6, forward: 1 };

/** The idle sway: how far, and how many seconds there and back. */
const sway = { right: 0.55, up: 0.25, seconds: 7, rampSeconds: 1.5 };

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Shortens (right, up) to a length of at most `limit`. */
function within(limit, right, up) {
    const length = Math.hypot(right, up);
    return length <= limit ? { right, up } : { right: (right * limit) / length, up: (up * limit) / length };
}

export class Motion {
    /** @param {() => boolean} isReduced  whether the person asked for reduced motion: then nothing sways and nothing eases */
    constructor(isReduced) {
        this.isReduced = isReduced;
        /** Where the viewer is now. @type {Reach} */
        this.reach = { right: 0, up: 0, forward: 0 };
        this.forget();
    }

    /** Back to where the photo was taken, and idle. */
    forget() {
        this.hovered = { right: 0, up: 0 };
        this.tilted = { right: 0, up: 0 };
        this.dragged = { right: 0, up: 0 };
        this.scrolled = 0; // -1 to 1
        this.isDragging = false;
        this.isIdle = true;
        this.idleSeconds = 0;
    }

    /** The mouse is at (right, up) in the frame, each -1 to 1. */
    hover(right, up) {
        this.isIdle = false;
        this.hovered = { right: clamp(right, -1, 1), up: clamp(up, -1, 1) };
    }

    /** The screen is turned so that the viewer is at (right, up) of it. Does not end the sway: a hand is never quite still. */
    tilt(right, up) {
        this.tilted = within(1, right, up);
    }

    /** A finger pulls the viewer by (right, up). */
    drag(right, up) {
        this.isIdle = false;
        this.isDragging = true;
        this.dragged = within(3, this.dragged.right + right, this.dragged.up + up);
    }

    /** The finger is lifted; who went too far comes back. */
    release() {
        this.isDragging = false;
        this.dragged = within(1, this.dragged.right, this.dragged.up);
    }

    /** One step with a key: like dragging, but never too far. */
    step(right, up) {
        this.isIdle = false;
        this.dragged = within(1, this.dragged.right + right, this.dragged.up + up);
    }

    /** @param {number} amount  2 is from one end to the other */
    scroll(amount) {
        this.isIdle = false;
        this.scrolled = clamp(this.scrolled + amount, -1, 1);
    }

    /** Where the viewer should be. @returns {Reach} */
    target() {
        let right = this.hovered.right + this.tilted.right + scrollReach.right * this.scrolled;
        let up = this.hovered.up + this.tilted.up + scrollReach.up * this.scrolled;
        if (this.isIdle && !this.isReduced()) {
            const phase = (2 * Math.PI * this.idleSeconds) / sway.seconds;
            const strength = Math.min(this.idleSeconds / sway.rampSeconds, 1);
            right += strength * sway.right * Math.sin(phase);
            up += strength * sway.up * Math.sin(2 * phase);
        }
        ({ right, up } = within(1, right, up));
        right += this.dragged.right;
        up += this.dragged.up;
        const length = Math.hypot(right, up);
        if (length > 1) {
            const room = dragLimit - 1;
            const kept = this.isDragging ? 1 + room * (1 - Math.exp((1 - length) / room)) : 1;
            ({ right, up } = within(kept, right, up));
        }
        return { right, up, forward: scrollReach.forward * this.scrolled };
    }

    /**
     * Moves the viewer on.
     *
     * @param {number} seconds  since the last call
     * @returns {boolean} whether the viewer has moved
     */
    advance(seconds) {
        if (this.isIdle) this.idleSeconds += seconds;
        const target = this.target();
        const share = this.isReduced() ? 1 : 1 - Math.exp(-seconds / easeSeconds);
        let hasMoved = false;
        for (const axis of /** @type {(keyof Reach)[]} */ (["right", "up", "forward"])) {
            const way = target[axis] - this.reach[axis];
            if (way === 0) continue;
            hasMoved = true;
            this.reach[axis] = Math.abs(way) < nothing ? target[axis] : this.reach[axis] + share * way;
        }
        return hasMoved;
    }
}
