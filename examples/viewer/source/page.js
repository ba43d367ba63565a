// The page of photo3d --html: an element that fills the window. Opens files that users choose or drop.

import "./element.js";

const element = (id) => document.getElementById(id);
const root = document.documentElement;

/** Returns the bytes of the GLB that photo3d embedded in the page, or null. @returns {ArrayBuffer | null} */
function photoInPage() {
    const base64 = element("photo")?.textContent;
    if (!base64) return null;
    const text = atob(base64);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    return bytes.buffer;
}

/** Returns the element that shows photos, and creates it on a page without a photo. */
function viewer() {
    let found = document.querySelector("photo-3d");
    if (!found) {
        found = document.createElement("photo-3d");
        found.setAttribute("standalone", "");
        element("page").append(found);
    }
    return found;
}

/** @param {File | undefined} file */
async function openFile(file) {
    if (!file) return;
    const shown = viewer();
    try {
        await shown.show(await file.arrayBuffer());
    } catch (failure) {
        if (failure.name === "AbortError") return; // the user opened another file meanwhile
        shown.report(`${file.name} can't be shown. ${failure.message}`);
        return;
    }
    element("empty").hidden = true;
    document.title = file.name.replace(/\.glb$/i, "");
    shown.setAttribute("caption", document.title);
    shown.setAttribute("alt", `3D photo ${document.title}`);
}

function listenForFiles() {
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
        openFile(event.dataTransfer.files[0]);
    });
    element("choose").addEventListener("click", () => element("file").click());
    element("file").addEventListener("change", ({ target }) => {
        openFile(target.files[0]);
        target.value = ""; // so that choosing the same file again fires "change"
    });
    addEventListener("keydown", (event) => {
        if (globalThis.parent !== globalThis || event.altKey || event.ctrlKey || event.metaKey || event.target.matches("input, textarea")) return;
        if (event.key === "o") element("file").click();
    });
}

/** Offers the HTML lines that photo3d --embed wrote into the page for copying. */
function offerEmbedding() {
    const snippet = element("snippet");
    if (!snippet) return;
    const lines = element("lines");
    lines.value = snippet.content.textContent;
    element("embed").hidden = false;
    element("embed").addEventListener("click", () => element("embedding").showModal());
    element("copy").addEventListener("click", () => {
        lines.select();
        if (navigator.clipboard) navigator.clipboard.writeText(lines.value).catch(() => document.execCommand("copy"));
        else document.execCommand("copy"); // for browsers in which pages from the disk have no navigator.clipboard
    });
}

/**
 * Shows a GLB file or a message. Pages that have this page in a frame call it.
 *
 * @param {ArrayBuffer | Uint8Array} bytes
 * @returns {Promise<boolean>} resolves to true when the photo is drawn, or to false if a message or another photo is shown instead
 */
async function showPhoto(bytes) {
    element("empty").hidden = true;
    const shown = viewer();
    try {
        await shown.show(bytes);
        // It may have been out of sight.
        if (!shown.complete) await new Promise((resolve) => ["load", "error"].forEach((name) => shown.addEventListener(name, resolve, { once: true })));
        return shown.complete;
    } catch (failure) {
        if (failure.name === "AbortError") return false; // another photo replaced it
        const isFlat = failure.name === "NotSupportedError";
        shown.report(isFlat ? `${failure.message} This is the flat photo.` : `This 3D photo can't be shown. ${failure.message}`);
        return false;
    }
}

function start() {
    const bytes = photoInPage();
    element("empty").hidden = bytes !== null;
    listenForFiles();
    offerEmbedding();
    if (bytes) showPhoto(bytes);
    globalThis.showPhoto = showPhoto;
}

start();
