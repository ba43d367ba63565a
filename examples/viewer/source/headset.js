// Headsets, through WebXR: stereo by three.js, the head's motion one to one, and a neck model for headsets that track only rotation.

import { Quaternion, Vector3 } from "three";
import { motionOf } from "./budget.js";

/** Offset from the neck's pivot to the point between the eyes in meters, facing -z. */
const neckToEyes = new Vector3(0, 0.075, -0.08);

/** Half the distance between the eyes in meters: the distance of each eye from the photo's viewpoint while the head rests. */
const halfEyeDistance = 0.032;

/** Limit of a head's motion if the file has none, as a share of the nearest surface's distance. */
const headRoom = 0.4;

/** Tracks the viewer's head during one WebXR session. Positions are in meters. */
export class Head {
    constructor() {
        /** The first pose, which becomes the photo's viewpoint. @type {{position: Vector3, turn: Quaternion} | null} */
        this.home = null;
        /** Position of the photo's origin that puts the head at its viewpoint. */
        this.photoPosition = new Vector3();
        /** Rotation of the photo about the vertical axis, toward the head's first direction. */
        this.photoTurn = new Quaternion();
        /** Position of the head relative to the photo's camera. */
        this.moved = new Vector3();
    }

    /** Updates the members from the head's pose. The first pose becomes the photo's viewpoint. @param {XRViewerPose} pose */
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
        // The headset determines the camera's position, so any correction moves the photo instead.
        this.photoPosition.copy(position).sub(moved);
        this.moved.copy(moved).applyQuaternion(this.photoTurn.clone().invert());
    }

    /**
     * Returns the translation of the eyes when the head turns on the neck (the paper: "rotating the head to the left also translates the
     * eyes leftward").
     */
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
 * Returns the head's motion as a share of its limit. The eyes of a resting head already use a part of the file's limit, because they are
 * beside the photo's viewpoint. The head's limit is the rest, but at least half of the file's limit, so that photos with very near surfaces
 * remain visible.
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
