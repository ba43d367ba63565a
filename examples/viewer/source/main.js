// Puts the page's parts together: shows the photo that the page holds, and files that are chosen or dropped.

import { offerHeadset } from "./headset.js";
import { listenToInput } from "./input.js";
import { Motion } from "./motion.js";
import { readPhoto } from "./photo.js";
import { Stage } from "./stage.js";
import { listenToTilt } from "./tilt.js";

const element = (id) => document.getElementById(id);
const root = document.documentElement;
const canvas = element("view");
const message = element("message");

function say(text) {
    message.textContent = text;
    message.hidden = text === "";
}

/** The bytes of the GLB that photo3d has put into the page, or null. @returns {ArrayBuffer | null} */
function photoInPage() {
    const base64 = element("photo")?.textContent;
    if (!base64) return null;
    const text = atob(base64);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    return bytes.buffer;
}

/** @param {Stage} stage @param {ArrayBuffer} bytes */
async function open(stage, bytes) {
    const photo = await readPhoto(bytes);
    root.style.setProperty("--photo-width", String(photo.aspect));
    root.style.setProperty("--photo-height", "1");
    root.style.setProperty("--hidden-border", photo.isPastFrame ? "0" : "var(--cropped-border)");
    root.classList.remove("is-empty");
    element("choose").hidden = true;
    canvas.hidden = false;
    await stage.show(photo, Number(getComputedStyle(root).getPropertyValue("--hidden-border")));
    element("poster")?.remove();
    say("");
}

/** @param {Stage} stage @param {File | undefined} file */
async function openFile(stage, file) {
    if (!file) return;
    try {
        await open(stage, await file.arrayBuffer());
        document.title = file.name.replace(/\.glb$/i, "");
    } catch (failure) {
        say(`${file.name} can't be shown. ${failure.message}`);
    }
}

/** @param {Stage} stage */
function listenForFiles(stage) {
    addEventListener("dragover", (event) => {
        event.preventDefault();
        root.classList.add("is-dropping");
    });
    addEventListener("dragleave", (event) => {
        if (!event.relatedTarget) root.classList.remove("is-dropping");
    });
    addEventListener("drop", (event) => {
        event.preventDefault();
        root.classList.remove("is-dropping");
        openFile(stage, event.dataTransfer.files[0]);
    });
    element("choose").addEventListener("click", () => element("file").click());
    element("file").addEventListener("change", (event) => openFile(stage, event.target.files[0]));
    addEventListener("keydown", (event) => {
        if (event.key === "o" && !event.ctrlKey && !event.metaKey) element("file").click();
    });
}

async function start() {
    const bytes = photoInPage();
    root.classList.toggle("is-empty", !bytes);
    const context = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!context) {
        say("This browser can't show 3D: it has no WebGL 2, or it is switched off. " + (bytes ? "This is the photo without it." : ""));
        return;
    }
    const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
    const motion = new Motion(() => reducedMotion.matches);
    const stage = new Stage(canvas, context, motion);
    listenToInput(element("frame"), motion);
    listenToTilt(element("tilt"), motion);
    listenForFiles(stage);
    if (bytes) {
        await open(stage, bytes);
    } else {
        say("Drop a 3D photo here: a GLB file.");
        element("choose").hidden = false;
    }
    await offerHeadset(element("headset"), stage, say);
    window.viewer = { state: () => stage.state(), setBackdrop: (isVisible) => stage.setBackdrop(isVisible) };
}

start().catch((failure) => {
    say(`This 3D photo can't be shown. ${failure.message}`);
    throw failure;
});
