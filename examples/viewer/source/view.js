// Shows one photo on one canvas: scene, camera, motion, and the visible part of the frame.

import { Color, Group, PerspectiveCamera, Scene } from "three";
import { Backdrop } from "./backdrop.js";
import { FlatFrame, headsetFrame, headVisibility, Veil } from "./frame.js";
import { headReach } from "./headset.js";
import { Pane } from "./pane.js";
import { disposeOf } from "./photo.js";

/** @typedef {import("./photo.js").Photo} Photo */

const wallColor = new Color(0x08090b);

export class View {
    /**
     * @param {HTMLCanvasElement} canvas
     * @param {import("./motion.js").Motion} motion
     */
    constructor(canvas, motion) {
        this.canvas = canvas;
        /** Size for the next drawing. To set the canvas's own size earlier would show an empty canvas until then. */
        this.width = canvas.width;
        this.height = canvas.height;
        this.pen = canvas.getContext("2d");
        this.motion = motion;
        this.pane = new Pane();
        this.camera = new PerspectiveCamera();
        this.scene = new Scene();
        this.place = new Group(); // at the origin on a flat screen; in front of the head in a headset
        this.veil = new Veil(wallColor);
        this.backdrop = new Backdrop(wallColor);
        this.scene.add(this.place, this.veil);
        /** @type {Photo | null} */
        this.photo = null;
        /** The head during a headset session. @type {import("./headset.js").Head | null} */
        this.head = null;
        this.isInSight = false;
        this.needsDrawing = this.isMoving = false;
        /** The renderer that drew the backdrop's picture. */
        this.preparedBy = null;
        /** Number of WebGL contexts in a row that were lost when they drew this view. */
        this.losses = 0;
        /** Reason why the photo can't be drawn. @type {Error | null} */
        this.failure = null;
        /** Receives the reason. */
        this.failed = () => {};
        this.whenDrawn = () => {};
        /** Reads the photo's position in a scrolling page. */
        this.follow = () => {};
    }

    /**
     * Replaces the current photo.
     *
     * @param {Photo} photo
     * @returns {Promise<boolean>} true when the photo is drawn; false if it fails or is released earlier
     */
    show(photo) {
        this.release();
        this.photo = photo;
        this.flatFrame = new FlatFrame(photo);
        if (photo.fillsView) this.place.add(this.backdrop);
        this.place.add(photo.model);
        this.motion.forget();
        this.pane.interest = photo.interest;
        this.pane.restart();
        Object.assign(this.motion.reach, { right: 0, up: 0, forward: 0 });
        this.needsDrawing = true;
        if (this.head) this.enterHeadset(this.head);
        return new Promise((resolve) => (this.whenDrawn = resolve));
    }

    /** Frees the photo's memory. The canvas keeps its picture. */
    release() {
        this.place.clear();
        if (this.photo) disposeOf(this.photo);
        if (this.wall) disposeOf({ model: this.wall });
        this.backdrop.release();
        this.photo = this.wall = this.preparedBy = this.flatFrame = null;
        this.failure = null;
        this.whenDrawn(false);
    }

    /** Gives up the photo. @param {Error} error */
    fail(error) {
        this.release();
        this.failure = error;
        this.failed(error);
    }

    /** @param {number} width @param {number} height  of the canvas, in canvas pixels */
    setSize(width, height) {
        Object.assign(this, { width, height });
        if (this.flatFrame) this.pane.fit(this.flatFrame.aspect, width / height);
        this.needsDrawing = true;
    }

    /** Advances the viewer. @param {number} seconds @returns {boolean} whether the view must be drawn again */
    advance(seconds) {
        const hasMoved = this.motion.advance(seconds);
        const isOther = this.pane.advance(this.motion.share(seconds));
        this.isMoving = hasMoved || isOther || this.motion.isSwaying;
        return hasMoved || isOther || this.needsDrawing;
    }

    /** Prepares the resources that need a renderer. @param {import("three").WebGLRenderer} renderer */
    prepare(renderer) {
        if (this.preparedBy === renderer) return;
        this.preparedBy = renderer;
        // sharpens the textures of surfaces that are seen at a slant
        const anisotropy = Math.min(4, renderer.capabilities.getMaxAnisotropy());
        this.photo.model.traverse((part) => {
            for (const material of [part.material ?? []].flat()) if (material.map) material.map.anisotropy = anisotropy;
        });
        if (this.photo.fillsView) this.backdrop.show(renderer, this.photo);
    }

    /** Draws for a flat screen, into the renderer's target. @param {import("three").WebGLRenderer} renderer */
    draw(renderer) {
        this.prepare(renderer);
        this.flatFrame.aim(this.camera, this.motion.reach, this.pane.edges);
        renderer.render(this.scene, this.camera);
    }

    /** Copies the picture from the lower left corner of another canvas. @param {HTMLCanvasElement} drawn */
    take(drawn) {
        const { width, height } = this;
        if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
        this.pen.globalCompositeOperation = "copy";
        this.pen.drawImage(drawn, 0, drawn.height - height, width, height, 0, 0, width, height);
        this.needsDrawing = false;
        this.whenDrawn(true);
    }

    /** @param {import("./headset.js").Head} head */
    enterHeadset(head) {
        this.head = head;
        this.wall ??= headsetFrame(this.photo, wallColor);
        this.place.add(this.wall);
        this.scene.background = wallColor;
    }

    leaveHeadset() {
        this.head = null;
        this.place.remove(this.wall);
        this.place.position.set(0, 0, 0);
        this.place.quaternion.identity();
        this.scene.background = null;
        this.veil.setVisibility(1);
        this.needsDrawing = true;
    }

    /** @param {import("three").WebGLRenderer} renderer @param {XRFrame} [frame] */
    drawInHeadset(renderer, frame) {
        const pose = frame?.getViewerPose(renderer.xr.getReferenceSpace());
        if (!pose || !this.photo) return;
        this.prepare(renderer);
        this.head.update(pose);
        this.place.position.copy(this.head.photoPosition);
        this.place.quaternion.copy(this.head.photoTurn);
        this.veil.setVisibility(headVisibility(headReach(this.head, this.photo)));
        renderer.render(this.scene, this.camera);
        this.eyes = renderer.xr.getCamera().cameras.map((eye) => this.place.worldToLocal(eye.position.clone()).toArray());
    }

    /** The current state of the view. */
    state() {
        const { right, up, forward } = this.motion.reach;
        return {
            reach: { right, up, forward },
            zoom: this.pane.now.zoom,
            angles: this.flatFrame?.angles(this.motion.reach) ?? null,
            motion: this.flatFrame?.motion(this.motion.reach) ?? null,
            visibility: 1 - this.veil.material.uniforms.opacity.value,
            isSwaying: this.motion.isSwaying,
            isMoving: this.isMoving || this.needsDrawing,
            isInHeadset: this.head !== null,
            eyes: this.head ? (this.eyes ?? []) : [],
        };
    }
}
