// Shows a 3D photo, and writes the page that shows it: the viewer of examples/viewer, as `photo3d --html` fills it.

import { readAsset, toBase64 } from "./assets.js";

/** @typedef {import("./converter.js").Photo3d} Photo3d */

const titleMarker = "<title>3D photo</title>";
const photoMarker = "<!-- the photo goes here -->";

let template;

const escapeHtml = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;");

/**
 * Returns a page of its own, without a reference to any other file.
 *
 * @param {Photo3d} photo
 * @param {string} title
 */
export async function pageWith(photo, title) {
    template ??= readAsset("viewer.html").then((bytes) => new TextDecoder().decode(bytes));
    const size = `--photo-width: ${photo.width}; --photo-height: ${photo.height}${photo.isPastFrame ? "; --hidden-border: 0" : ""}`;
    const content =
        `<style>:root { ${size} }</style>\n<img id="poster" alt="" src="data:image/jpeg;base64,${toBase64(photo.poster)}">\n` +
        `<script id="photo" type="model/gltf-binary;base64">${toBase64(photo.glb)}</script>`;
    const [beforeTitle, afterTitle] = (await template).split(titleMarker);
    const [head, tail] = afterTitle.split(photoMarker);
    return `${beforeTitle}<title>${escapeHtml(title)}</title>${head}${content}${tail}`;
}

/**
 * Shows a page of pageWith() in a frame. The viewer sways until the first touch.
 *
 * @param {HTMLIFrameElement} frame
 * @param {string} page
 * @returns {Promise<HTMLCanvasElement | null>} when the 3D photo is drawn; null if the viewer shows a message instead
 */
export async function showPhoto(frame, page) {
    await new Promise((resolve) => {
        frame.addEventListener("load", resolve, { once: true });
        frame.srcdoc = page;
    });
    const { contentWindow: inside, contentDocument: content } = frame;
    while (!inside.viewer) {
        const message = content.getElementById("message");
        if (message && !message.hidden && message.textContent !== "") return null;
        await new Promise((resolve) => setTimeout(resolve, 20));
    }
    return content.getElementById("view");
}
