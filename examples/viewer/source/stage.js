// The only renderer of a page. It draws all visible photos, one after the other, and copies each to its canvas. It draws only while
// something moves, and recovers when the browser drops its context.

import { NoToneMapping, WebGLRenderer } from "three";

/** @typedef {import("./view.js").View} View */

/** Seconds until the first attempt to replace a lost context. Each further attempt waits twice as long, until a context lasts. */
const retrySeconds = 0.25;

/** Wait after which there are no further attempts. */
const maxRetrySeconds = 60;

/** A context lasts if it still draws after this time. */
const lastingSeconds = 5;

/** Number of contexts in a row that a photo may lose. Then it is no longer drawn. */
const maxLosses = 3;

class Stage {
    constructor() {
        /** @type {Set<View>} */
        this.views = new Set();
        /** @type {WebGLRenderer | null} */
        this.renderer = null;
        this.counts = { contexts: 0, frames: 0, drawings: 0 };
        this.requested = 0;
        this.lastTime = null;
        this.isScrolled = true;
        this.wait = retrySeconds;
        this.hasSession = false;
        /** Views of the last frame. If the context is lost, one of them is the cause. @type {View[]} */
        this.drawn = [];
        this.contextTime = 0;
    }

    /** @param {View} view */
    add(view) {
        if (this.views.size === 0) {
            this.whenScrolled = () => {
                this.isScrolled = true;
                this.scrollTime = performance.now();
                this.request();
            };
            document.addEventListener("scroll", this.whenScrolled, { capture: true, passive: true });
        }
        this.views.add(view);
    }

    /** @param {View} view */
    remove(view) {
        this.views.delete(view);
        if (this.views.size > 0) return;
        document.removeEventListener("scroll", this.whenScrolled, { capture: true });
        if (!this.hasSession) this.renderer?.setSize(1, 1, false); // frees memory; fit() enlarges it
    }

    /** Requests an animation frame, in which draw() draws every photo that has changed. */
    request() {
        if (this.requested === 0 && !this.hasSession) this.requested = requestAnimationFrame((time) => this.draw(time));
    }

    /** Returns the renderer, created on first use. Throws without WebGL 2. */
    need() {
        if (this.renderer) return this.renderer;
        const canvas = document.createElement("canvas");
        const context = canvas.getContext("webgl2", { antialias: true, alpha: true });
        if (!context) throw new DOMException("This browser can't show 3D: it has no WebGL 2, or it is switched off.", "NotSupportedError");
        const renderer = new WebGLRenderer({ canvas, context });
        renderer.toneMapping = NoToneMapping; // the screen shows the photo's colors unchanged
        renderer.setPixelRatio(1);
        renderer.setClearColor(0, 0);
        renderer.xr.enabled = true;
        renderer.xr.setReferenceSpaceType("local");
        this.counts.contexts += 1;
        this.contextTime = performance.now();
        this.renderer = renderer;
        canvas.addEventListener("webglcontextlost", () => this.comeBack(renderer), { once: true });
        return renderer;
    }

    /** Replaces a lost context, which the browser may never restore. */
    comeBack(lost) {
        if (this.renderer === lost) {
            this.renderer = null;
            lost.dispose();
        }
        for (const view of this.drawn) {
            view.losses += 1;
            if (view.losses >= maxLosses) view.fail(new Error("The browser can't draw it."));
        }
        this.drawn = [];
        this.retry();
    }

    retry() {
        if (this.wait > maxRetrySeconds) return;
        setTimeout(() => {
            try {
                this.need();
            } catch {
                return this.retry();
            }
            for (const view of this.views) view.needsDrawing = true;
            this.request();
        }, 1000 * this.wait);
        this.wait *= 2;
    }

    /** @param {number} time  in milliseconds */
    draw(time) {
        this.requested = 0;
        const seconds = this.lastTime === null ? 1 / 60 : Math.min(Math.max((time - this.lastTime) / 1000, 0), 0.1);
        const shown = [...this.views].filter((view) => view.isInSight && view.photo);
        if (this.isScrolled) for (const view of shown) view.follow();
        this.isScrolled = false;
        const due = shown.filter((view) => view.advance(seconds));
        if (due.length > 0 && this.renderer) this.render(due, shown);
        const goesOn = shown.some((view) => view.isMoving);
        this.lastTime = goesOn ? time : null;
        if (goesOn) this.request();
    }

    /** @param {View[]} due @param {View[]} shown */
    render(due, shown) {
        this.fit(shown);
        this.counts.frames += 1;
        this.drawn = [];
        this.renderer.setScissorTest(true); // clears only the drawn area
        for (const view of due) {
            this.drawn.push(view);
            try {
                this.renderView(view);
            } catch (failure) {
                if (!this.isLost) view.fail(new Error(`It can't be drawn: ${failure.message}`)); // the other photos are drawn nevertheless
            }
            if (this.isLost) return;
        }
        if (performance.now() - this.contextTime < 1000 * lastingSeconds) return;
        this.wait = retrySeconds;
        for (const view of this.views) view.losses = 0;
    }

    get isLost() {
        return this.renderer.getContext().isContextLost();
    }

    /** @param {View} view */
    renderView(view) {
        const { renderer } = this;
        const { width, height } = view;
        renderer.setViewport(0, 0, width, height);
        renderer.setScissor(0, 0, width, height);
        view.draw(renderer);
        if (this.isLost) return;
        view.take(renderer.domElement);
        this.counts.drawings += renderer.info.render.calls;
    }

    /**
     * Makes the renderer's canvas large enough for every visible photo. Shrinks it if it has more than four times the necessary pixels.
     *
     * @param {View[]} shown
     */
    fit(shown) {
        const width = Math.max(...shown.map((view) => view.width));
        const height = Math.max(...shown.map((view) => view.height));
        const drawn = this.renderer.domElement;
        if (drawn.width >= width && drawn.height >= height && drawn.width * drawn.height <= 4 * width * height) return;
        this.renderer.setSize(width, height, false);
    }

    /** @param {View} view @param {XRSession} session @param {import("./headset.js").Head} head */
    async enterHeadset(view, session, head) {
        const renderer = this.need();
        this.hasSession = true;
        session.addEventListener("end", () => {
            this.hasSession = false;
            renderer.setAnimationLoop(null);
            view.leaveHeadset();
            for (const other of this.views) other.needsDrawing = true;
            this.request();
        });
        renderer.setScissorTest(false);
        try {
            await renderer.xr.setSession(session);
        } catch (failure) {
            await session.end();
            throw failure;
        }
        if (!view.photo) return session.end(); // the photo was removed meanwhile
        view.enterHeadset(head);
        renderer.setAnimationLoop((_, frame) => view.head && view.drawInHeadset(renderer, frame));
    }

    /** Returns counts of the work so far, and of the objects in graphics memory. */
    statistics() {
        const { geometries = 0, textures = 0 } = this.renderer?.info.memory ?? {};
        const photos = [...this.views].filter((view) => view.photo).length;
        return { ...this.counts, geometries, textures, photos };
    }
}

export const stage = new Stage();
