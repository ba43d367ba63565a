// Draws: the photo on the canvas or in a headset, from where the motion or the head says.

import { Color, Group, NoToneMapping, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { Backdrop } from "./backdrop.js";
import { FlatFrame, headsetFrame, headVisibility, Veil, visibility } from "./frame.js";
import { headReach } from "./headset.js";
import { disposeOf } from "./photo.js";

/** @typedef {import("./photo.js").Photo} Photo */

const wallColor = new Color(0x08090b);

/** Sharper screens than this cost more than they show. */
const mostPixelsPerPixel = 2;

export class Stage {
    /**
     * @param {HTMLCanvasElement} canvas
     * @param {WebGL2RenderingContext} context
     * @param {import("./motion.js").Motion} motion
     */
    constructor(canvas, context, motion) {
        this.canvas = canvas;
        this.motion = motion;
        this.renderer = new WebGLRenderer({ canvas, context });
        this.renderer.toneMapping = NoToneMapping; // the photo's colors reach the screen as they are
        this.renderer.xr.enabled = true;
        this.renderer.xr.setReferenceSpaceType("local");
        this.camera = new PerspectiveCamera();
        this.scene = new Scene();
        this.scene.background = wallColor;
        this.place = new Group(); // at the origin on a flat screen, in front of the head in a headset
        this.veil = new Veil(wallColor);
        this.backdrop = new Backdrop(wallColor);
        this.scene.add(this.place, this.veil);
        /** @type {Photo | null} */
        this.photo = null;
        /** The head, while there is a session. @type {import("./headset.js").Head | null} */
        this.head = null;
        this.needsDrawing = true;
        this.lastTime = 0;
        this.whenDrawn = () => {};
        new ResizeObserver(() => this.fitCanvas()).observe(canvas);
        canvas.addEventListener("webglcontextrestored", () => {
            if (this.photo?.fillsView) this.backdrop.show(this.renderer, this.photo); // what was drawn before is lost
            this.needsDrawing = true;
        });
    }

    /**
     * Shows a photo in place of the one before.
     *
     * @param {Photo} photo
     * @param {number} hiddenBorder  see FlatFrame
     * @returns {Promise<void>} when it is on the screen
     */
    show(photo, hiddenBorder) {
        if (this.photo) {
            this.place.clear();
            disposeOf(this.photo);
            disposeOf({ model: this.wall });
        }
        this.photo = photo;
        this.flatFrame = new FlatFrame(photo, hiddenBorder);
        this.wall = headsetFrame(photo, wallColor);
        this.sharpenTextures();
        if (photo.fillsView) {
            this.backdrop.show(this.renderer, photo);
            this.place.add(this.backdrop);
        }
        this.place.add(photo.model, this.wall);
        this.motion.forget();
        Object.assign(this.motion.reach, { right: 0, up: 0, forward: 0 });
        this.fitCanvas();
        return new Promise((resolve) => {
            this.whenDrawn = resolve;
            this.needsDrawing = true; // what fitCanvas() has drawn was before somebody waited
            this.renderer.setAnimationLoop((time, frame) => this.draw(time, frame));
        });
    }

    /** Textures are seen at a slant where surfaces lead away from the viewer. */
    sharpenTextures() {
        const anisotropy = Math.min(4, this.renderer.capabilities.getMaxAnisotropy());
        this.photo.model.traverse((part) => {
            for (const material of [part.material ?? []].flat()) if (material.map) material.map.anisotropy = anisotropy;
        });
    }

    fitCanvas() {
        const { clientWidth, clientHeight } = this.canvas;
        if (this.renderer.xr.isPresenting || clientWidth === 0) return;
        this.renderer.setPixelRatio(Math.min(devicePixelRatio, mostPixelsPerPixel));
        this.renderer.setSize(clientWidth, clientHeight, false);
        this.needsDrawing = true;
        this.draw(this.lastTime); // at once: a canvas of a new size is empty
    }

    /** @param {XRSession} session @param {import("./headset.js").Head} head */
    async enterHeadset(session, head) {
        session.addEventListener("end", () => {
            this.head = null;
            this.place.position.set(0, 0, 0);
            this.place.quaternion.identity();
            this.fitCanvas();
            this.needsDrawing = true;
        });
        await this.renderer.xr.setSession(session);
        this.head = head;
    }

    /** @param {number} time  in milliseconds @param {XRFrame} [frame]  in a session */
    draw(time, frame) {
        if (!this.photo) return;
        const seconds = Math.min(Math.max((time - this.lastTime) / 1000, 0), 0.1); // a hidden page does not leap ahead
        this.lastTime = time;
        const isDue = this.head ? this.followHead(frame) : this.followMotion(seconds);
        if (!isDue) return;
        this.renderer.render(this.scene, this.camera);
        this.needsDrawing = false;
        this.whenDrawn();
    }

    followMotion(seconds) {
        const hasMoved = this.motion.advance(this.needsDrawing ? 0 : seconds);
        if (!hasMoved && !this.needsDrawing) return false;
        this.wall.visible = false;
        this.flatFrame.aim(this.camera, this.motion.reach);
        this.veil.setVisibility(visibility(Math.hypot(this.motion.reach.right, this.motion.reach.up)));
        return true;
    }

    followHead(frame) {
        const pose = frame?.getViewerPose(this.renderer.xr.getReferenceSpace());
        if (!pose) return false;
        this.head.update(pose);
        this.place.position.copy(this.head.photoPosition);
        this.place.quaternion.copy(this.head.photoTurn);
        this.wall.visible = true;
        this.veil.setVisibility(headVisibility(headReach(this.head, this.photo)));
        return true;
    }

    /** Shows or hides the backdrop, for tests and for the curious in the console. */
    setBackdrop(isVisible) {
        this.backdrop.visible = isVisible;
        this.needsDrawing = true;
    }

    /** What is seen now, for tests and for the curious in the console. */
    state() {
        const { right, up, forward } = this.motion.reach;
        return {
            reach: { right, up, forward },
            angles: this.flatFrame.angles(this.motion.reach),
            motion: this.flatFrame.motion(this.motion.reach),
            visibility: 1 - this.veil.material.uniforms.opacity.value,
            isIdle: this.motion.isIdle,
            isInHeadset: this.head !== null,
            headDistance: this.head?.moved.length() ?? 0,
            eyes: this.head ? this.renderer.xr.getCamera().cameras.map((eye) => this.place.worldToLocal(eye.position.clone()).toArray()) : [],
        };
    }
}
