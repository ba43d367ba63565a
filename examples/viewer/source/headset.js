// Headsets, through WebXR: stereo by three.js, the head's motion one to one, and a neck where a headset knows only how it is turned.

import { Quaternion, Vector3 } from "three";
import { motionOf } from "./budget.js";

/** From where the neck turns to between the eyes, in meters, facing -z. */
const neckToEyes = new Vector3(0, 0.075, -0.08);

/** Half the distance between two eyes, in meters: what a head that rests uses of the photo's motion. */
const halfEyeDistance = 0.032;

/** How far a head may go where the file does not say, as a share of the distance of the nearest surface. */
const headRoom = 0.4;

/** Follows one session's head. Positions are in meters. */
export class Head {
    constructor() {
        /** The first pose: where the photo is to be seen from. @type {{position: Vector3, turn: Quaternion} | null} */
        this.home = null;
        /** Where the origin of the photo is to be put, for the head to see it from where it should. */
        this.photoPosition = new Vector3();
        /** The turn of the photo about the vertical, towards where the head looked at first. */
        this.photoTurn = new Quaternion();
        /** Where the head is, from where the photo was taken. */
        this.moved = new Vector3();
    }

    /** @param {XRViewerPose} pose */
    update(pose) {
        const { position: p, orientation: o } = pose.transform;
        const position = new Vector3(p.x, p.y, p.z);
        const turn = new Quaternion(o.x, o.y, o.z, o.w);
        if (!this.home) {
            this.home = { position, turn };
            const ahead = new Vector3(0, 0, -1).applyQuaternion(turn);
            this.photoTurn.setFromAxisAngle(new Vector3(0, 1, 0), Math.atan2(-ahead.x, -ahead.z));
        }
        const moved = pose.emulatedPosition ? this.neckMotion(turn) : position.clone().sub(this.home.position);
        // The camera is where the headset says. Where it should be elsewhere, the photo moves instead.
        this.photoPosition.copy(position).sub(moved);
        this.moved.copy(moved).applyQuaternion(this.photoTurn.clone().invert());
    }

    /** How the eyes move when the head turns on the neck: "rotating the head to the left also translates the eyes leftward". */
    neckMotion(turn) {
        return neckToEyes.clone().applyQuaternion(turn).sub(neckToEyes.clone().applyQuaternion(this.home.turn));
    }
}

/** @returns {Promise<boolean>} whether there is a headset */
export async function hasHeadset() {
    return (await navigator.xr?.isSessionSupported("immersive-vr").catch(() => false)) ?? false;
}

/** @returns {Promise<XRSession>} */
export const requestHeadset = () => navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["local"] });

/**
 * How far the head has gone: at 1 an eye sees as much as the photo has hidden surfaces for. What two eyes use at rest counts as
 * nothing, and as no more than half of all: very near things cannot be seen with two eyes otherwise.
 *
 * @param {Head} head
 * @param {import("./photo.js").Photo} photo
 */
export function headReach(head, photo) {
    const { x, y, z } = head.moved;
    if (!photo.budget) return head.moved.length() / (headRoom * photo.nearest);
    const atRest = motionOf({ x: halfEyeDistance, y: 0, z: 0 }, photo.budget);
    const used = motionOf({ x: Math.abs(x) + halfEyeDistance, y, z }, photo.budget) - atRest;
    return used / Math.max(photo.budget.motion - atRest, 0.5 * photo.budget.motion, 1e-6);
}
