// Position of the viewer: the sum of the motions from mouse, device, scrolling, dragging and keys, limited and eased. This module is
// independent of the page, three.js and the photo: all values are in the units of Reach (frame.js), where 1 is the limit of the motion.

/** @typedef {import("./frame.js").Reach} Reach */

/** Seconds in which the viewer moves two thirds of the way to its target: during input (`led`), and on the way back to rest (`resting`). */
const easeSeconds = { led: 0.12, resting: 0.35 };

/** Differences of position below this are invisible. */
const nothing = 1e-3;

/** Motion from scrolling the photo from the window's center to an edge. */
const scrollReach = { right: 0.15, up: 0.6, forward: 1 };

/** The idle sway: amplitude, seconds per cycle, and seconds of fade-in. */
const sway = { right: 0.55, up: 0.25, seconds: 7, rampSeconds: 1.5 };

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Shortens (right, up) to a length of at most `limit`. */
function within(limit, right, up) {
    const length = Math.hypot(right, up);
    return length <= limit ? { right, up } : { right: (right * limit) / length, up: (up * limit) / length };
}

export class Motion {
    /** @param {() => boolean} isReduced  whether the user requested reduced motion, without sway and easing */
    constructor(isReduced) {
        this.isReduced = isReduced;
        /** Current position of the viewer. @type {Reach} */
        this.reach = { right: 0, up: 0, forward: 0 };
        /** Number of cycles of the sway. Afterwards, the viewer is at rest. */
        this.turns = 3;
        this.scrolled = 0; // position of the photo in the window of a scrolling page, -1 to 1
        this.tilted = { right: 0, up: 0 };
        this.forget();
    }

    /** Resets to the photo's viewpoint and restarts the sway. */
    forget() {
        this.hovered = { right: 0, up: 0 };
        this.dragged = { right: 0, up: 0 };
        this.approached = 0;
        this.isIdle = true;
        this.idleSeconds = 0;
        this.ease = easeSeconds.led;
    }

    /** Resets to the photo's viewpoint without sway. */
    reset() {
        this.forget();
        this.isIdle = false;
    }

    /** Ends the sway; every input calls this. */
    lead() {
        this.isIdle = false;
        this.ease = easeSeconds.led;
    }

    /** Handles a mouse at (right, up) in the frame, each -1 to 1. */
    hover(right, up) {
        this.lead();
        this.hovered = { right: clamp(right, -1, 1), up: clamp(up, -1, 1) };
    }

    /** Handles a device orientation that puts the viewer at (right, up). Does not stop the sway, because a hand is never still. */
    tilt(right, up) {
        this.tilted = within(1, right, up);
    }

    /** Moves the viewer by (right, up), for a finger or a key. */
    drag(right, up) {
        this.lead();
        this.dragged = within(1, this.dragged.right + right, this.dragged.up + up);
    }

    /** Returns the viewer to rest when the pointer leaves; keeps the position with reduced motion. */
    leave() {
        if (this.isReduced()) return;
        this.hovered = { right: 0, up: 0 };
        this.dragged = { right: 0, up: 0 };
        this.ease = easeSeconds.resting;
    }

    /** @param {number} place  position of the photo in the window: -1 at the window's lower edge, 1 at its upper edge */
    scroll(place) {
        this.scrolled = this.isReduced() ? 0 : clamp(place, -1, 1);
    }

    /** @param {number} forward  position on the way into the scene, -1 to 1 */
    approach(forward) {
        this.approached = clamp(forward, -1, 1);
    }

    /** Returns the target position of the viewer. @returns {Reach} */
    target() {
        let right = this.hovered.right + this.tilted.right + scrollReach.right * this.scrolled;
        let up = this.hovered.up + this.tilted.up + scrollReach.up * this.scrolled;
        if (this.isIdle && !this.isReduced()) {
            const phase = (2 * Math.PI * this.idleSeconds) / sway.seconds;
            const strength = Math.min(this.idleSeconds / sway.rampSeconds, 1);
            right += strength * sway.right * Math.sin(phase);
            up += strength * sway.up * Math.sin(2 * phase);
        }
        ({ right, up } = within(1, right + this.dragged.right, up + this.dragged.up));
        return { right, up, forward: clamp(scrollReach.forward * this.scrolled + this.approached, -1, 1) };
    }

    /** Returns the share of the way to the target that the viewer moves in this time, 0 to 1. @param {number} seconds */
    share(seconds) {
        return this.isReduced() ? 1 : 1 - Math.exp(-seconds / this.ease);
    }

    /**
     * Advances the viewer.
     *
     * @param {number} seconds  since the last call
     * @returns {boolean} whether the viewer has moved
     */
    advance(seconds) {
        if (this.isIdle) this.idleSeconds += seconds;
        if (this.idleSeconds >= this.turns * sway.seconds) this.isIdle = false;
        const target = this.target();
        const share = this.share(seconds);
        let hasMoved = false;
        for (const axis of /** @type {(keyof Reach)[]} */ (["right", "up", "forward"])) {
            const way = target[axis] - this.reach[axis];
            if (way === 0) continue;
            hasMoved = true;
            this.reach[axis] = Math.abs(way) < nothing ? target[axis] : this.reach[axis] + share * way;
        }
        return hasMoved;
    }

    /** Whether the sway is running, even at its momentary turning points. */
    get isSwaying() {
        return this.isIdle && !this.isReduced();
    }
}
