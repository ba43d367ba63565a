// The orientation of a phone or tablet. The scene is like a box behind the screen, and the viewer's head stays in place when the screen
// turns. A screen that turns to the right shows the box from the left.

import { Euler, Quaternion, Vector3 } from "three";

/** @typedef {import("./motion.js").Motion} Motion */

/** Rotating the device by this angle reaches the motion limit. */
const fullTilt = (20 * Math.PI) / 180;

/** Seconds in which the neutral orientation moves two thirds of the way to the current orientation. */
const followSeconds = 20;

/**
 * Tracks the direction of the viewer's head relative to the screen. Assumes that the head is straight in front of the screen at first. If
 * the user moves, or holds the device differently, the assumed position gradually returns to the middle of the screen.
 */
export class HeadDirection {
    constructor() {
        /** Direction to the head in world axes. @type {Vector3 | null} */
        this.head = null;
        this.time = 0;
    }

    /**
     * @param {{alpha: number, beta: number, gamma: number}} orientation  in degrees, as in a DeviceOrientationEvent
     * @param {number} screenAngle  rotation of the picture on the screen, in degrees
     * @param {number} time  in seconds
     * @returns {{right: number, up: number}} the angles of the head to the right of the screen and above it, in radians
     */
    update({ alpha, beta, gamma }, screenAngle, time) {
        const radians = Math.PI / 180;
        // Z-X'-Y'' in world axes, "ZXY" in three.js
        const device = new Quaternion().setFromEuler(new Euler(beta * radians, gamma * radians, alpha * radians, "ZXY"));
        const straight = new Vector3(0, 0, 1).applyQuaternion(device);
        this.head ??= straight.clone();
        this.head.lerp(straight, 1 - Math.exp(-Math.max(time - this.time, 0) / followSeconds)).normalize();
        this.time = time;
        const seen = this.head.clone().applyQuaternion(device.invert());
        seen.applyAxisAngle(new Vector3(0, 0, 1), screenAngle * radians); // from the device's axes to the picture's
        return { right: Math.atan2(seen.x, seen.z), up: Math.atan2(seen.y, seen.z) };
    }
}

/** Changes below this share of fullTilt are tremor of the hand. */
const nothing = 0.004;

/** Listeners of all photos of a page. @type {Set<(right: number, up: number) => void>} */
const listeners = new Set();
const direction = new HeadDirection();
let last = { right: 0, up: 0 };
let isHeard = false;

function turned({ alpha, beta, gamma, timeStamp }) {
    if (alpha === null || beta === null || gamma === null) return; // a device without sensors
    isHeard = true;
    const { right, up } = direction.update({ alpha, beta, gamma }, screen.orientation?.angle ?? 0, timeStamp / 1000);
    if (Math.hypot(right - last.right, up - last.up) < nothing * fullTilt) return;
    last = { right, up };
    for (const listener of listeners) listener(right / fullTilt, up / fullTilt);
}

/** @param {(right: number, up: number) => void} listener  receives the head's position, in units of Reach (frame.js) */
export function listenToTilt(listener) {
    if (listeners.size === 0) addEventListener("deviceorientation", turned);
    listeners.add(listener);
}

export function stopListeningToTilt(listener) {
    listeners.delete(listener);
    if (listeners.size === 0) removeEventListener("deviceorientation", turned);
}

/** Whether the page must request permission for the orientation, which requires the press of a button (iOS). */
export function mustAskForTilt() {
    const canBeAsked = typeof globalThis.DeviceOrientationEvent?.requestPermission === "function";
    return canBeAsked && navigator.maxTouchPoints > 0 && !isHeard;
}

/** Requests the permission. Without it, users can still drag the photo. @returns {Promise<void>} */
export async function askForTilt() {
    await DeviceOrientationEvent.requestPermission().catch(() => {});
}
