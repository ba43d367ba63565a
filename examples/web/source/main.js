// The page: reads a photo, shows the progress and the 3D photo, and saves it.

import { Converter } from "./converter.js";
import { canShare, record, save, share, videoType } from "./save.js";
import { loadViewer, pageWith, showPhoto } from "./viewer.js";

/** @typedef {import("./converter.js").Photo3d} Photo3d */

const element = (id) => document.getElementById(id);
const root = document.documentElement;

/** Stages in order, with their names for users and their share of the time. */
const stages = new Map([
    ["reading photo", ["Reading the photo", 0.05]],
    ["depth estimation", ["Estimating depth", 0.28]],
    ["depth filter", ["Cleaning depth", 0.14]],
    ["connected components", ["Cleaning depth", 0.01]],
    ["occluded geometry", ["Growing hidden surfaces", 0.05]],
    ["color inpainting", ["Coloring hidden surfaces", 0.26]],
    ["chart generation", ["Cutting the surfaces", 0.05]],
    ["chart padding", ["Packing the texture", 0.05]],
    ["meshing", ["Building the mesh", 0.04]],
    ["encoding", ["Writing the file", 0.07]],
]);

/** Seconds after which the page no longer waits for the viewer to draw the 3D photo. Meanwhile, the viewer shows the flat photo. */
const viewerSeconds = 15;

/** Length of videos: one cycle of the viewer's sway. */
const videoSeconds = 7;

const converter = new Converter();
/** The 3D photo on the page. @type {{photo: Photo3d, name: string} | null} */
let shown = null;
/** Resolves when the frame can show photos. Null after a failure; the next photo loads the viewer again. @type {Promise<void> | null} */
let viewer = null;
let isBusy = false;

/**
 * @param {"empty" | "busy" | "recording" | "shown"} view
 * @param {boolean} [becomesBusy]  whether the page refuses photos and disables its buttons, except those that save what is shown
 */
function setView(view, becomesBusy = view === "busy" || view === "recording") {
    root.dataset.view = view;
    isBusy = becomesBusy;
    element("frame").inert = view === "recording"; // input would end the sway
    for (const id of ["choose", "camera", "again", "video", "share"]) element(id).disabled = isBusy;
    for (const id of ["glb", "page"]) element(id).disabled = isBusy && view !== "shown";
}

function say(text, isError = false) {
    element("status").textContent = isError ? "" : text;
    element("error").textContent = isError ? text : "";
    element("error").hidden = !isError;
}

const report = (failure) => say(failure.message, true);

function showProgress(label, fraction) {
    if (element("stage").textContent !== label) element("stage").textContent = label;
    element("progress").value = fraction;
}

/** Shows the progress of the whole conversion, from the progress of one stage. */
function onProgress(stage, fraction) {
    let before = 0;
    for (const [name, [label, share]] of stages) {
        if (name === stage) return showProgress(label, before + share * fraction);
        before += share;
    }
}

/** @param {File | undefined | null} file */
async function convert(file) {
    if (!file || isBusy) return;
    say("");
    setView("busy");
    showProgress("Loading the networks", 0);
    try {
        const photo = await converter.convert(new Uint8Array(await file.arrayBuffer()), file.name, onProgress);
        showProgress("Opening the 3D photo", 1);
        const name = file.name.replace(/\.[^.]*$/, "") || "photo";
        shown = { photo, name };
        const canvas = await open();
        const isLate = canvas === undefined ? " The browser has not drawn the 3D photo yet. This is the flat photo." : "";
        say(`${name} is ready.${photo.depthSource ? ` Depth: ${photo.depthSource}.` : ""}${isLate}`);
    } catch (failure) {
        setView(shown ? "shown" : "empty");
        say(failure.message, true);
        keepFocus(shown ? "again" : "choose");
    }
}

/** Focuses a button if the page has lost the focus because the focused button was hidden. */
function keepFocus(id) {
    const { activeElement } = document;
    if (activeElement === document.body || activeElement.getClientRects().length === 0) element(id).focus();
}

/**
 * Shows the 3D photo from its beginning.
 *
 * @param {"shown" | "recording"} view
 * @returns {Promise<HTMLCanvasElement | null | undefined>} null if the viewer shows a message instead; undefined if it does not draw in time
 */
async function open(view = "shown") {
    const { photo, name } = shown;
    setView(view, true); // busy until the photo is drawn
    const drawing = readyViewer().then(() => showPhoto(element("frame"), photo, name));
    const offerVideo = (canvas) => {
        const isOffered = canvas && videoType() && !matchMedia("(prefers-reduced-motion: reduce)").matches;
        if (shown.photo === photo) element("video").hidden = !isOffered;
        return canvas;
    };
    const deadline = new Promise((resolve) => setTimeout(resolve, 1000 * viewerSeconds));
    const canvas = offerVideo(await Promise.race([drawing, deadline]));
    if (canvas === undefined) drawing.then(offerVideo, () => {}); // it may still be drawn, for example when the user returns to this tab
    setView(view);
    element("share").hidden = !canShare(fileOf("", name));
    if (document.activeElement === document.body) element("frame").focus(); // the focused button is gone, so the viewer handles keys
    return canvas;
}

/** Loads the viewer into the frame, unless it is there. */
const readyViewer = () =>
    (viewer ??= startViewer().catch((failure) => {
        viewer = null;
        throw failure;
    }));

async function startViewer() {
    await loadViewer(element("frame"));
    const inside = element("frame").contentWindow;
    listenForFiles(inside);
    inside.addEventListener(
        "drop",
        (event) => {
            event.stopImmediatePropagation(); // the viewer would open it as a GLB
            inside.document.documentElement.classList.remove("is-dropping");
        },
        true,
    );
}

const fileOf = (page, name) => new File([page], `${name}.html`, { type: "text/html" });

/** Makes the file of a self-contained page with the 3D photo. */
async function pageFile() {
    const { photo, name } = shown;
    return fileOf(await pageWith(photo, name), name);
}

async function saveVideo() {
    if (isBusy) return;
    setView("busy");
    showProgress("Recording the video", 0);
    try {
        const canvas = await open("recording");
        if (!canvas) throw new Error("The 3D photo can't be shown, so it can't be recorded.");
        const video = await record(canvas, videoSeconds, (fraction) => showProgress("Recording the video", fraction));
        save(video, `${shown.name}.${video.type.startsWith("video/mp4") ? "mp4" : "webm"}`);
        say("The video is saved.");
    } catch (failure) {
        say(failure.message, true);
    }
    setView("shown");
    keepFocus("video");
}

/** Converts a file that the user drops on an element, or pastes into it. */
function listenForFiles(where) {
    where.addEventListener("dragover", (event) => {
        event.preventDefault();
        root.classList.add("is-dropping");
    });
    where.addEventListener("dragleave", (event) => {
        if (!event.relatedTarget) root.classList.remove("is-dropping");
    });
    where.addEventListener(
        "drop",
        (event) => {
            event.preventDefault();
            root.classList.remove("is-dropping");
            convert(event.dataTransfer.files[0]);
        },
        true,
    );
    where.addEventListener("paste", (event) => {
        const file = [...event.clipboardData.files].find(({ type }) => type.startsWith("image/"));
        if (file) convert(file);
        else if (!shown) say("The clipboard has no picture.", true);
    });
}

function start() {
    for (const id of ["file", "camera-file"])
        element(id).addEventListener("change", ({ target }) => {
            convert(target.files[0]);
            target.value = ""; // so that choosing the same file again fires "change"
        });
    element("choose").addEventListener("click", () => element("file").click());
    element("again").addEventListener("click", () => element("file").click());
    element("camera").addEventListener("click", () => element("camera-file").click());
    const isTouched = matchMedia("(pointer: coarse)").matches;
    element("camera").hidden = !isTouched;
    if (isTouched) element("prompt").textContent = "Choose or take a photo";
    element("glb").addEventListener("click", () => save(new Blob([shown.photo.glb], { type: "model/gltf-binary" }), `${shown.name}.glb`));
    element("page").addEventListener("click", () => pageFile().then((file) => save(file, file.name)).catch(report));
    element("video").addEventListener("click", saveVideo);
    element("share").addEventListener("click", () => pageFile().then(share).catch(report));
    listenForFiles(window);
    setView("empty");
    readyViewer().catch(() => {}); // the first photo will report the error
    converter.ready.catch((failure) => say(`The converter can't start. ${failure.message}`, true));
    if (location.protocol === "https:" || location.hostname === "localhost") {
        const register = () => navigator.serviceWorker?.register("offline.js");
        // After the download, so that the browser's cache has the files. Without a service worker the page works, but not offline.
        converter.ready.finally(register).catch(() => {});
    }
}

start();

/** For tests and for the console. */
window.photo3d = { converter, shown: () => shown };
