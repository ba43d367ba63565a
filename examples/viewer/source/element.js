// <photo-3d src="x.glb" poster="x.jpg" alt="...">: a 3D photo in any page. README.md lists attributes, properties, events, methods, parts.

import sheetText from "./element.css";
import { makeParts, setIcon } from "./dom.js";
import { croppedBorder } from "./frame.js";
import { hasHeadset, Head, requestHeadset } from "./headset.js";
import { noteUse, offerHint } from "./hint.js";
import { Input } from "./input.js";
import { enqueue, unwatch, watch, withdraw } from "./loads.js";
import { Motion } from "./motion.js";
import { disposeOf, readPhoto } from "./photo.js";
import { stage } from "./stage.js";
import { askForTilt, listenToTilt, mustAskForTilt, stopListeningToTilt } from "./tilt.js";
import { View } from "./view.js";

/** Maximum number of pixels of a canvas. More pixels would make no visible difference. */
const maxPixels = 6_000_000;

/** Maximum side of a canvas in pixels, which graphics cards support. */
const maxSide = 8192;

/** Seconds until the buttons over a full-screen photo disappear. */
const quietSeconds = 3;

/**
 * A full-screen photo covers the screen if the screen's width / height is at most `aspect` and the whole photo would fill less than `share`
 * of the screen.
 */
const upright = { aspect: 0.7, share: 0.8 };

/** Maximum length of the photo's description in the names of buttons. */
const maxTitle = 60;

/** Attributes that are also properties. */
const reflected = ["src", "poster", "alt", "caption", "fit", "loading"];

let sheet;
const reducedMotion = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)");
const isReduced = () => reducedMotion.matches;
/** Whether the page has an address to share. Documents of frames with `srcdoc`, and of data: and blob: URLs, have none. */
const hasAddress = () => /^(https?|file):/.test(location.href);
const Base = globalThis.HTMLElement ?? class {}; // allows imports outside browsers, where HTMLElement is missing

export class Photo3D extends Base {
    static observedAttributes = ["src", "poster", "alt", "caption", "width", "height", "fit", "sway", "standalone", "frame", "loading"];

    #parts;
    #motion = new Motion(isReduced);
    #view;
    #input;
    #sizes;
    #tilted;
    #pressed;
    #fullscreenChanged;
    #watcher;
    #waiting;
    /** The photo's width / height, once known. */
    #aspect = 0;
    #isNear = false;
    /** The current or last load; a new load replaces it. @type {{source: string | null, abort: AbortController} | null} */
    #load = null;
    #swayedSource = "";
    /** Called when the photo leaves the window, so that #show() stops waiting. */
    #left = () => {};
    #isOver = false;
    #wasFullscreen = false;
    #coverChoice = null;
    #quiet = 0;
    /** Whether the buttons were invisible when the last press began. */
    #pressedHidden = false;

    constructor() {
        super();
        // Before the shadow root, so that a browser without such sheets keeps showing the poster inside the element.
        if (!sheet) (sheet = new CSSStyleSheet()).replaceSync(sheetText);
        const root = this.attachShadow({ mode: "open" });
        root.adoptedStyleSheets = [sheet];
        this.#parts = makeParts(root);
        const { photo, canvas, poster, box } = this.#parts;
        this.#view = new View(canvas, this.#motion);
        this.#view.follow = () => this.#follow();
        this.#view.failed = (error) => {
            if (this.#hasPoster()) this.#hideCanvas();
            this.#fail(error);
        };
        this.#input = new Input({ photo, motion: this.#motion, pane: this.#view.pane, isAlone: () => this.isAlone, changed: () => this.#changed(), used: () => this.#used() });
        this.#input.listen(box);
        this.#sizes = new ResizeObserver(() => this.#layout());
        this.#tilted = (right, up) => {
            if (isReduced()) return;
            this.#motion.tilt(right, up);
            if (this.#view.isInSight) stage.request();
        };
        poster.addEventListener("load", () => this.#layout());
        root.querySelector("slot").addEventListener("slotchange", () => this.#layout());
        this.#listenToButtons();
        this.#revealControls();
        this.#pressed = (event) => this.#keyPressed(event);
        this.#fullscreenChanged = () => this.matches(":fullscreen") !== this.#wasFullscreen && this.#aloneChanged();
        this.#watcher = {
            sightChanged: (isInSight, share) => this.#sightChanged(isInSight, share),
            nearnessChanged: (isNear) => this.#nearnessChanged(isNear),
        };
        this.#waiting = { distance: () => this.#distance(), load: () => this.#loadSource() };
    }

    connectedCallback() {
        for (const name of reflected) {
            if (!Object.hasOwn(this, name)) continue; // set before this module was loaded
            const value = this[name];
            delete this[name];
            this[name] = value;
        }
        stage.add(this.#view);
        this.#sizes.observe(this.#parts.box);
        listenToTilt(this.#tilted);
        document.addEventListener("fullscreenchange", this.#fullscreenChanged);
        this.#aloneChanged();
        watch(this, this.#watcher);
    }

    disconnectedCallback() {
        unwatch(this);
        this.#sizes.disconnect();
        stopListeningToTilt(this.#tilted);
        document.removeEventListener("fullscreenchange", this.#fullscreenChanged);
        removeEventListener("keydown", this.#pressed);
        if (this.#isOver) this.#coverPage(false); // the browser hides popovers that leave the page
        this.#sightChanged(false, 0);
        this.#isNear = false;
        stage.remove(this.#view);
        this.#release();
    }

    attributeChangedCallback(name, before, value) {
        const { poster, caption } = this.#parts;
        if (before === value) return;
        if (name === "src") this.#sourceChanged();
        if (name === "loading" && this.isConnected) this.#loadIfDue();
        if (name === "poster") poster.hidden = value === null;
        if (name === "poster" || name === "loading") queueMicrotask(() => this.#loadPoster()); // the page may set `loading` after `poster`
        if (name === "alt") this.#describe();
        if (name === "caption") {
            caption.textContent = value ?? "";
            this.#aloneChanged();
        }
        if (name === "sway") this.#motion.turns = value === null ? 3 : Math.max(Number(value) || 0, 0);
        if (name === "standalone") this.#aloneChanged();
        this.#layout();
    }

    // Properties

    /** Whether the photo fills the screen. */
    get isAlone() {
        return this.#isOver || this.hasAttribute("standalone") || this.matches(":fullscreen");
    }

    /** Whether the 3D photo has replaced its poster on the screen. */
    get complete() {
        return this.#parts.box.classList.contains("drawn");
    }

    /** The canvas that shows the photo, for `captureStream()` and `toBlob()`. */
    get canvas() {
        return this.#parts.canvas;
    }

    // Methods

    /**
     * Shows a GLB file in memory. Call clear() before you discard the element, because only clear() frees such a photo.
     *
     * @param {ArrayBuffer | Uint8Array} bytes
     * @returns {Promise<void>} resolves when the photo is drawn, or at once while the element is out of sight; rejects if it can't be shown,
     * with an AbortError if another photo replaces it first
     */
    async show(bytes) {
        this.#load?.abort.abort();
        const { abort } = (this.#load = { source: null, abort: new AbortController() });
        try {
            const photo = await readPhoto(bytes);
            if (abort.signal.aborted) disposeOf(photo);
            else await this.#show(photo);
        } catch (failure) {
            if (!abort.signal.aborted) {
                this.#load = null; // `src` may be loaded again
                this.#loadIfDue();
                throw failure;
            }
        }
        abort.signal.throwIfAborted();
    }

    /** Removes the photo, and shows the poster. Loads the photo of `src`, if there is one. */
    clear() {
        this.#sourceChanged();
    }

    /** Shows a message over the photo; an empty one removes it. @param {string} text */
    report(text) {
        this.#say(text);
    }

    focus(options) {
        this.#parts.photo.focus(options);
    }

    /** Resets the viewer to the photo's viewpoint, without magnification. */
    reset() {
        this.#input.reset();
        stage.request();
    }

    /** Restarts the sway. */
    sway() {
        this.#motion.forget();
        stage.request();
    }

    /** Moves the viewer; 1 is the photo's limit. @param {Partial<import("./frame.js").Reach>} reach */
    lookFrom({ right = 0, up = 0, forward = 0 }) {
        this.#motion.reset();
        this.#motion.drag(right, up);
        this.#motion.approach(forward);
        stage.request();
    }

    /** Fills the screen. In browsers without full screen (iPhones), the element covers the page instead. */
    async enterFullscreen() {
        if (this.requestFullscreen && document.fullscreenEnabled) return this.requestFullscreen();
        this.#coverPage(true);
    }

    async exitFullscreen() {
        if (this.matches(":fullscreen")) return document.exitFullscreen();
        this.#coverPage(false);
    }

    /** Shares the page's address. If the browser cannot or does not share it, or the page is on the disk, copies or shows the address. */
    async share() {
        if (!this.dispatchEvent(new CustomEvent("share", { cancelable: true })) || !hasAddress()) return;
        const url = location.href;
        const title = this.getAttribute("caption") || document.title;
        try {
            if (navigator.share && /^https?:/.test(url)) return await navigator.share({ title, url });
        } catch (failure) {
            if (failure.name === "AbortError") return; // the user canceled
        }
        try {
            await navigator.clipboard.writeText(url);
            this.#say("The address is copied.", 3);
        } catch {
            this.#say(`The address is ${url}`, 10);
        }
    }

    /** The current state of the view. */
    state() {
        return this.#view.state();
    }

    /** Shows or hides the backdrop. Without it, the gaps of the mesh are visible. */
    setBackdrop(isVisible) {
        this.#view.backdrop.visible = isVisible;
        this.#view.needsDrawing = true;
        stage.request();
    }

    /** Counts of the work for all photos of the page, and the graphics memory in use. */
    static statistics() {
        return stage.statistics();
    }

    // Loading

    #sightChanged(isInSight, share) {
        if (isInSight && !this.#view.isInSight) this.#view.needsDrawing = true;
        this.#view.isInSight = isInSight;
        if (!isInSight) return this.#left();
        this.#follow();
        stage.request();
        if (share >= 0.5 && this.complete) this.#offerHint();
    }

    #nearnessChanged(isNear) {
        this.#isNear = isNear;
        if (isNear || this.getAttribute("loading") === "eager") this.#loadIfDue();
        else this.#release();
    }

    /** Frees the photo. It will be loaded from `src` again. */
    #release() {
        withdraw(this.#waiting);
        if (!this.#load || this.#load.source === null) return; // nothing loaded, or a photo from show(), which can't be loaded again
        this.#load.abort.abort();
        this.#load = null;
        this.#view.release();
        if (this.#hasPoster()) this.#hideCanvas();
    }

    #loadPoster() {
        const { poster } = this.#parts;
        const source = this.getAttribute("poster");
        poster.loading = this.getAttribute("loading") === "lazy" ? "lazy" : "eager";
        if (source === null) poster.removeAttribute("src");
        else if (poster.getAttribute("src") !== source) poster.src = source;
    }

    #hasPoster() {
        return this.hasAttribute("poster") || this.querySelector('[slot="poster"]') !== null;
    }

    #hideCanvas() {
        this.#parts.box.classList.remove("drawn");
        this.#parts.canvas.hidden = true;
        this.#parts.canvas.width = this.#parts.canvas.height = 1;
    }

    #sourceChanged() {
        withdraw(this.#waiting);
        this.#load?.abort.abort();
        this.#load = null;
        this.#say("");
        if (this.complete) this.#hideCanvas();
        this.#view.release();
        this.#aspect = 0;
        this.#layout();
        this.#loadIfDue();
    }

    #loadIfDue() {
        const isDue = this.isConnected && !this.#load && (this.#isNear || this.getAttribute("loading") === "eager");
        if (isDue && this.getAttribute("src")) enqueue(this.#waiting);
    }

    #distance() {
        const { top, height } = this.getBoundingClientRect();
        return Math.abs(top + height / 2 - innerHeight / 2);
    }

    async #loadSource() {
        const source = this.getAttribute("src");
        const load = (this.#load = { source, abort: new AbortController() });
        const { signal } = load.abort;
        try {
            stage.need(); // without WebGL, the file would be of no use
            const photo = await readPhoto(await fetchGlb(source, signal));
            if (signal.aborted) return disposeOf(photo);
            await this.#show(photo);
            if (signal.aborted) return;
            if (source === this.#swayedSource) this.#motion.reset(); // a photo that returns into view does not sway again
            this.#swayedSource = source;
        } catch (failure) {
            if (!signal.aborted && failure !== this.#view.failure) this.#fail(failure);
        }
    }

    #fail(error) {
        const isPicture = error.name === "NotSupportedError" && this.#hasPoster() && !this.isAlone; // without WebGL, posters replace messages
        if (!isPicture) this.#say(`This 3D photo can't be shown. ${error.message}`);
        this.dispatchEvent(new ErrorEvent("error", { error, message: error.message }));
    }

    /**
     * Shows a photo. Waits until the photo is drawn, released, or outside the window.
     *
     * @param {import("./photo.js").Photo} photo
     */
    async #show(photo) {
        const { box, canvas } = this.#parts;
        try {
            stage.need();
        } catch (failure) {
            disposeOf(photo);
            throw failure;
        }
        const isDrawn = this.#view.show(photo);
        this.#aspect = photo.aspect;
        this.#coverChoice = null;
        box.classList.toggle("cropped", !photo.isPastFrame);
        canvas.hidden = false;
        this.#layout();
        stage.request();
        isDrawn.then((wasDrawn) => {
            if (!wasDrawn) return;
            box.classList.add("drawn");
            this.#say("");
            this.dispatchEvent(new Event("load"));
            if (this.#view.isInSight) this.#offerHint();
        });
        const hasLeft = new Promise((resolve) => (this.#left = resolve));
        if (this.#view.isInSight) await Promise.race([isDrawn, hasLeft]);
        if (this.#view.failure) throw this.#view.failure;
    }

    #offerHint() {
        if (!this.#isDecorative) offerHint(this.#parts.hint, { isAlone: this.isAlone, isReduced: isReduced() });
    }

    // Layout

    /** Whether the photo is a decoration of a page. */
    get #isDecorative() {
        return this.getAttribute("alt") === "" && !this.isAlone;
    }

    /** Describes the photo to screen readers. They skip decorations. */
    #describe() {
        const { photo, title, controls } = this.#parts;
        const isDecorative = this.#isDecorative;
        const alt = this.getAttribute("alt") || "3D photo";
        photo.setAttribute("aria-label", alt);
        photo.setAttribute("aria-hidden", String(isDecorative));
        if (isDecorative) photo.removeAttribute("tabindex");
        else photo.tabIndex = 0;
        title.textContent = alt.length > maxTitle ? `${alt.slice(0, maxTitle).replace(/\s+\S*$/, "")} …` : alt;
        controls.hidden = isDecorative;
    }

    #knownAspect() {
        const { poster } = this.#parts;
        const slotted = this.querySelector('img[slot="poster"]');
        const given = Number(this.getAttribute("width")) / Number(this.getAttribute("height"));
        return this.#aspect || (given > 0 && given < Infinity ? given : 0) || poster.naturalWidth / poster.naturalHeight || slotted?.naturalWidth / slotted?.naturalHeight || 4 / 3;
    }

    /** Returns whether the photo should cover its box, and whether to offer a button that toggles this. */
    #cover(aspect, boxAspect) {
        const fit = this.getAttribute("fit");
        const filled = Math.min(aspect / boxAspect, boxAspect / aspect);
        const isUsual = fit === "cover" || (fit !== "contain" && this.isAlone && boxAspect <= upright.aspect && filled < upright.share);
        return { isCovered: this.#coverChoice ?? isUsual, isOffered: this.isAlone && filled < 0.98 };
    }

    /** Sets position and size of photo and canvas. */
    #layout() {
        if (!this.isConnected) return;
        const { box, photo, fit } = this.#parts;
        const aspect = this.#knownAspect();
        box.style.aspectRatio = this.isAlone ? "" : String(aspect);
        box.style.setProperty("--_shown", String(1 / (1 - 2 * croppedBorder)));
        if (!this.#aspect) box.classList.toggle("cropped", this.getAttribute("frame") === "crop");
        const { clientWidth, clientHeight } = box;
        if (clientWidth === 0 || clientHeight === 0) return;
        const { isCovered, isOffered } = this.#cover(aspect, clientWidth / clientHeight);
        const width = isCovered ? clientWidth : Math.min(clientWidth, clientHeight * aspect);
        const height = isCovered ? clientHeight : Math.min(clientHeight, clientWidth / aspect);
        const [left, top] = [(clientWidth - width) / 2, (clientHeight - height) / 2];
        Object.assign(photo.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` });
        box.classList.toggle("beside", this.isAlone && left > 64 && top < 64);
        box.classList.toggle("below", this.isAlone && top >= 64);
        box.style.setProperty("--_room", `${Math.max(left, 120)}px`);
        fit.hidden = !isOffered;
        setIcon(fit, "fit", isCovered ? "Show the whole photo" : "Fill the screen");
        const ratio = Math.min(devicePixelRatio, Math.sqrt(maxPixels / (width * height)), maxSide / Math.max(width, height));
        if (this.#view.photo) this.#view.setSize(Math.max(Math.round(width * ratio), 1), Math.max(Math.round(height * ratio), 1));
        this.#follow();
        stage.request();
    }

    /** Moves the photo by its position in the window of a scrolling page. */
    #follow() {
        if (this.isAlone) return this.#motion.scroll(0);
        const { top, height } = this.#parts.box.getBoundingClientRect();
        this.#motion.scroll((innerHeight / 2 - (top + height / 2)) / ((innerHeight + height) / 2));
    }

    /** @param {boolean} isOver */
    #coverPage(isOver) {
        const { box } = this.#parts;
        if (!isOver) box.removeAttribute("popover");
        else if (box.showPopover) {
            box.setAttribute("popover", "manual");
            box.showPopover(); // in the browser's top layer, transforms, filters and containment of ancestors have no effect
        }
        this.#isOver = isOver;
        this.#aloneChanged();
    }

    #aloneChanged() {
        const { box, caption, fullscreen, reset, share, headset, tilt } = this.#parts;
        const { isAlone } = this;
        this.#wasFullscreen = this.matches(":fullscreen");
        box.classList.toggle("alone", isAlone);
        box.classList.toggle("over", this.#isOver);
        this.#input.setAlone(isAlone);
        // A full-screen photo handles all keys. A photo in a page handles only keys that are pressed while it has the focus.
        box.removeEventListener("keydown", this.#pressed);
        removeEventListener("keydown", this.#pressed);
        if (this.isConnected) (isAlone ? globalThis : box).addEventListener("keydown", this.#pressed);
        if (!isAlone) {
            this.#coverChoice = null;
            this.#view.pane.reset();
            this.#motion.approach(0);
        }
        const isFull = this.#isOver || this.matches(":fullscreen");
        setIcon(fullscreen, isFull ? "leave" : "fullscreen", isFull ? "Leave full screen" : "Full screen");
        fullscreen.hidden = this.hasAttribute("standalone") && !document.fullscreenEnabled; // a standalone element fills the page already
        reset.hidden = !isAlone;
        share.hidden = !isAlone || !hasAddress();
        caption.hidden = !isAlone || !caption.textContent;
        tilt.hidden = !isAlone || !mustAskForTilt() || isReduced();
        if (isAlone) hasHeadset().then((isThere) => (headset.hidden = !isThere || !this.isAlone));
        else headset.hidden = true;
        if (isAlone) this.#keepQuiet();
        this.#describe();
        this.#layout();
    }

    // Input

    #changed() {
        this.#keepQuiet();
        stage.request();
    }

    #used() {
        noteUse();
        this.#parts.hint.hidden = true;
    }

    /** Shows the buttons for some seconds, and as long as they are in use. */
    #keepQuiet() {
        clearTimeout(this.#quiet);
        const { box } = this.#parts;
        box.classList.remove("quiet");
        if (!this.isAlone) return;
        this.#quiet = setTimeout(() => (this.#usesControls() ? this.#keepQuiet() : box.classList.add("quiet")), 1000 * quietSeconds);
    }

    /** Whether the mouse is over the buttons, or the keyboard has focused one of them. */
    #usesControls() {
        const { controls } = this.#parts;
        const canHover = matchMedia("(hover: hover)").matches; // after a tap, touch screens report a hover that does not end
        return (canHover && controls.matches(":hover")) || controls.querySelector(":focus-visible") !== null;
    }

    /** Lets a press where the buttons are invisible only reveal them. */
    #revealControls() {
        const { box, controls } = this.#parts;
        const began = () => {
            this.#pressedHidden = getComputedStyle(controls).pointerEvents === "none";
            this.#keepQuiet();
        };
        box.addEventListener("pointerdown", began, { capture: true });
        box.addEventListener("pointermove", ({ pointerType }) => pointerType === "mouse" && this.#keepQuiet());
        controls.addEventListener("focusin", () => this.#keepQuiet());
        const clicked = (event) => {
            const isPress = event.detail > 0; // a click by key or by script has no press
            if (isPress && this.#pressedHidden) event.stopPropagation();
        };
        controls.addEventListener("click", clicked, { capture: true });
    }

    #keyPressed(event) {
        if (event.altKey || event.ctrlKey || event.metaKey) return;
        if (event.composedPath()[0].matches?.("input, textarea, select, [contenteditable]")) return;
        if (event.key === "f") this.#toggleFullscreen();
        else if (event.key === "Escape" && this.#isOver) this.exitFullscreen();
        else if (!this.#input.keyPressed(event.key)) return;
        event.preventDefault();
    }

    #toggleFullscreen() {
        const isFull = this.#isOver || this.matches(":fullscreen");
        return (isFull ? this.exitFullscreen() : this.enterFullscreen()).catch(() => {}); // the browser refused
    }

    #listenToButtons() {
        const { tilt, headset, fit, reset, share, fullscreen } = this.#parts;
        tilt.addEventListener("click", () => {
            tilt.hidden = true;
            askForTilt();
        });
        headset.addEventListener("click", async () => {
            if (!this.#view.photo) return this.#say("There is no photo to view in the headset yet.");
            try {
                await stage.enterHeadset(this.#view, await requestHeadset(), new Head());
            } catch (failure) {
                this.#say(`The headset can't be used: ${failure.message}`);
            }
        });
        fit.addEventListener("click", () => {
            const { clientWidth, clientHeight } = this.#parts.box;
            this.#coverChoice = !this.#cover(this.#knownAspect(), clientWidth / clientHeight).isCovered;
            this.#view.pane.reset();
            this.#motion.approach(0);
            this.#layout();
        });
        reset.addEventListener("click", () => this.reset());
        share.addEventListener("click", () => this.share());
        fullscreen.addEventListener("click", () => this.#toggleFullscreen());
    }

    /** Shows a message. @param {string} text @param {number} [seconds]  time until it disappears; default: never */
    #say(text, seconds) {
        const { message } = this.#parts;
        message.textContent = text;
        message.hidden = text === "";
        if (seconds) setTimeout(() => message.textContent === text && this.#say(""), 1000 * seconds);
    }
}

for (const name of reflected)
    Object.defineProperty(Photo3D.prototype, name, {
        get() {
            return this.getAttribute(name) ?? "";
        },
        set(value) {
            if (value === null || value === undefined) this.removeAttribute(name);
            else this.setAttribute(name, value);
        },
    });

/** @param {string} source @param {AbortSignal} signal @returns {Promise<ArrayBuffer>} */
async function fetchGlb(source, signal) {
    let response;
    try {
        response = await fetch(source, { signal });
    } catch (failure) {
        if (signal.aborted) throw failure;
        throw new Error("Its file can't be fetched.");
    }
    if (!response.ok) throw new Error(`The server did not return the file (status ${response.status}).`);
    return response.arrayBuffer();
}

if (globalThis.customElements && !customElements.get("photo-3d")) customElements.define("photo-3d", Photo3D);
