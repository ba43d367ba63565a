// The frame that hides the outer boundary of the photo, and the limits that follow from it (section "Viewing 3D Photos" of the paper: "a 3D
// model viewed through a 2D frame"). If surfaces continue past the photo's border (include/ldi/occlusion/past_frame.hpp), the frame shows
// the whole photo, and the viewer may use the whole budget.
//
// On a flat screen, the edge of the canvas is the frame. It is fixed to the photo at the distance of the *pivot*: surfaces at this distance
// stay in place on the screen when the viewer moves sideways; nearer and farther surfaces move in opposite directions.

import { Color, DoubleSide, Group, Mesh, MeshBasicMaterial, Path, PlaneGeometry, ShaderMaterial, Shape, ShapeGeometry } from "three";

import { asideWithin, motionOf, withinMotion } from "./budget.js";

/** @typedef {import("./photo.js").Photo} Photo */

/**
 * A position of the viewer in units of the motion limits; (0, 0, 0) is the photo's camera.
 *
 * @typedef {object} Reach
 * @property {number} right
 * @property {number} up
 * @property {number} forward
 */

/** Share of the hidden border that sideways motion uses. Moving back uses the rest. */
const sideways = 0.75;

/** Distance that the viewer approaches at `forward` 1, as a share of the nearest surface's distance. */
const wayIn = 0.22;

/**
 * Share of a photo that the frame hides on each side if surfaces end at the photo's border: of the width on the left and right, of the
 * height at the top and bottom.
 */
export const croppedBorder = 0.034;

/** Results of headReach() between which the model fades from opaque to invisible. A flat screen has no fading. */
const fading = { begin: 0.7, end: 1 };

/** @param {number} reach  see headReach(). @returns {number} 1: opaque, 0: invisible */
export function headVisibility(reach) {
    const t = Math.min(Math.max((fading.end - reach) / (fading.end - fading.begin), 0), 1);
    return t * t * (3 - 2 * t);
}

/** The frame on a flat screen. Lengths are in the photo's units. */
export class FlatFrame {
    /** @param {Photo} photo */
    constructor(photo) {
        this.budget = photo.budget;
        const halfWidth = photo.halfHeight * photo.aspect;
        const hidden = photo.isPastFrame || !photo.fillsView ? 0 : croppedBorder;
        /**
         * Width at distance 1 of the hidden border along the longer sides. It is the narrower border, so it limits the motion in every
         * direction.
         */
        const border = 2 * croppedBorder * Math.min(halfWidth, photo.halfHeight);
        this.aspect = photo.aspect;
        /** Half the visible size at distance 1. */
        this.halfWidth = halfWidth * (1 - 2 * hidden);
        this.halfHeight = photo.halfHeight * (1 - 2 * hidden);
        /** Distance at the mean disparity, so that the nearest and the farthest surface move equally far. */
        const { nearest, farthest } = photo.isPastFrame ? photo.budget : photo;
        this.pivot = 2 / (1 / nearest + 1 / farthest);
        /**
         * Maximum sideways distance. For a cropped photo: there, the nearest and the farthest surface have moved by the sideways share of
         * the border.
         */
        this.farthestAside = photo.isPastFrame ? asideWithin(photo.budget) : (sideways * border) / (1 / nearest - 1 / this.pivot);
        // Limits sideways motion for photos with little depth.
        this.farthestAside = Math.min(this.farthestAside, 0.35 * this.pivot);
        this.farthestIn = wayIn * photo.nearest;
        /** Maximum distance back. For a cropped photo: there, the nearest surface has shrunk by the rest of the border. */
        this.farthestBack = (photo.nearest * (1 - sideways) * border) / Math.max(halfWidth, photo.halfHeight);
        if (photo.isPastFrame) this.farthestBack = this.farthestIn;
        /** Whether the frame stays on the photo's border at the pivot when the viewer moves back. */
        this.keepsPhotoInFrame = photo.isPastFrame;
        this.near = 0.05 * photo.nearest;
        this.far = 10 * photo.farthest;
    }

    /** Returns the position of the viewer relative to the photo's camera. @param {Reach} reach */
    position({ right, up, forward }) {
        const away = forward > 0 ? -forward * this.farthestIn : -forward * this.farthestBack;
        return withinMotion({ x: right * this.farthestAside, y: up * this.farthestAside, z: away }, this.budget);
    }

    /** Returns the viewer's angles around the pivot in degrees. @param {Reach} reach */
    angles(reach) {
        const { x, y } = this.position(reach);
        const degrees = (aside) => (Math.atan2(aside, this.pivot) * 180) / Math.PI;
        return { horizontal: degrees(x), vertical: degrees(y) };
    }

    /**
     * Returns the parallax between the nearest and the farthest surface as a share of the photo's long side; null if the file has no limit.
     *
     * @param {Reach} reach
     */
    motion(reach) {
        return this.budget && motionOf(this.position(reach), this.budget);
    }

    /**
     * Moves the camera to the viewer, and sets its frustum to the frame.
     *
     * @param {import("three").PerspectiveCamera} camera
     * @param {Reach} reach
     * @param {{left: number, right: number, bottom: number, top: number}} edges  the visible part of the frame, -1 to 1 (see Pane)
     */
    aim(camera, reach, edges) {
        const { x, y, z } = this.position(reach);
        const toPivot = this.pivot + z;
        const scale = this.near;
        const shown = this.keepsPhotoInFrame ? Math.min(this.pivot / toPivot, 1) : 1;
        camera.position.set(x, y, z);
        camera.quaternion.identity();
        camera.near = this.near;
        camera.far = this.far;
        camera.projectionMatrix.makePerspective(
            scale * (shown * this.halfWidth * edges.left - x / toPivot),
            scale * (shown * this.halfWidth * edges.right - x / toPivot),
            scale * (shown * this.halfHeight * edges.top - y / toPivot),
            scale * (shown * this.halfHeight * edges.bottom - y / toPivot),
            this.near,
            this.far,
        );
        camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
    }
}

/** A veil over the camera's whole view, into which the model fades. It covers a screen and the views of both eyes. */
export class Veil extends Mesh {
    /** @param {Color} color */
    constructor(color) {
        const material = new ShaderMaterial({
            uniforms: { color: { value: color }, opacity: { value: 0 } },
            vertexShader: "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
            fragmentShader:
                "uniform vec3 color; uniform float opacity;" +
                "void main() { gl_FragColor = vec4(color, opacity);\n#include <colorspace_fragment>\n}",
            transparent: true,
            depthTest: false,
            depthWrite: false,
        });
        super(new PlaneGeometry(2, 2), material);
        this.frustumCulled = false;
        this.renderOrder = 1; // after the model
        this.setVisibility(1);
    }

    /** @param {number} visibility  of the surfaces behind, 1 to 0 */
    setVisibility(visibility) {
        this.material.uniforms.opacity.value = 1 - visibility;
        this.visible = visibility < 1;
    }
}

/**
 * The frame in a headset: a dark wall with an opening, in front of all surfaces of the photo, and a lighter rim around the opening.
 *
 * @param {Photo} photo
 * @param {Color} wallColor
 * @returns {Group}
 */
export function headsetFrame(photo, wallColor) {
    const distance = 0.9 * photo.nearest;
    const shown = 0.94; // share of the photo's width and height
    const halfHeight = photo.halfHeight * distance * shown;
    const halfWidth = photo.halfHeight * photo.aspect * distance * shown;
    const rim = 0.03 * Math.min(halfWidth, halfHeight);
    const frame = new Group();
    frame.add(border(halfWidth, halfHeight, rim, new Color(0x3a3c44)));
    frame.add(border(halfWidth + rim, halfHeight + rim, 50 * Math.max(halfWidth, halfHeight), wallColor));
    frame.position.z = -distance;
    for (const part of frame.children) part.renderOrder = 2; // after the veil, so that the frame stays when the model fades
    return frame;
}

/** A flat border around an opening. */
function border(halfWidth, halfHeight, thickness, color) {
    const rectangle = (path, w, h) => path.moveTo(-w, -h).lineTo(w, -h).lineTo(w, h).lineTo(-w, h).closePath();
    const shape = rectangle(new Shape(), halfWidth + thickness, halfHeight + thickness);
    shape.holes.push(rectangle(new Path(), halfWidth, halfHeight));
    return new Mesh(new ShapeGeometry(shape), new MeshBasicMaterial({ color: color, side: DoubleSide, toneMapped: false }));
}
