// Shows a 3D photo, and makes its page: the viewer of examples/viewer, filled as `photo3d --html` does.

import { readAsset, toBase64 } from "./assets.js";

/** @typedef {import("./converter.js").Photo3d} Photo3d */

const titleMarker = "<title>3D photo</title>";
const photoMarker = "<!-- the photo goes here -->";

let template;

const escapeHtml = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/"/g, "&quot;");

/**
 * Returns a self-contained page.
 *
 * @param {Photo3d} photo
 * @param {string} title
 */
export async function pageWith(photo, title) {
    template ??= readAsset("viewer.html").then((bytes) => new TextDecoder().decode(bytes));
    const shown = escapeHtml(title);
    const content =
        `<photo-3d standalone caption="${shown}" alt="3D photo ${shown}" width="${photo.width}" height="${photo.height}"${photo.isPastFrame ? "" : ' frame="crop"'}>\n` +
        `<img slot="poster" alt="" src="data:image/jpeg;base64,${toBase64(photo.poster)}">\n</photo-3d>\n` +
        `<script id="photo" type="model/gltf-binary;base64">${toBase64(photo.glb)}</script>`;
    const [beforeTitle, afterTitle] = (await template).split(titleMarker);
    const [head, tail] = afterTitle.split(photoMarker);
    return `${beforeTitle}<title>${shown}</title>${head}${content}${tail}`;
}

/**
 * Shows a page of pageWith() in a frame. The 3D photo sways until the first touch.
 *
 * @param {HTMLIFrameElement} frame
 * @param {string} page
 * @returns {Promise<HTMLCanvasElement | null>} resolves to the canvas when the 3D photo is drawn, or to null if the viewer shows a message
 * instead
 */
export async function showPhoto(frame, page) {
    await new Promise((resolve) => {
        frame.addEventListener("load", resolve, { once: true });
        frame.srcdoc = page;
    });
    const shown = frame.contentDocument.querySelector("photo-3d");
    const message = shown.shadowRoot.getElementById("message");
    while (!shown.complete) {
        if (!message.hidden) return null;
        await new Promise((resolve) => setTimeout(resolve, 20));
    }
    return shown.canvas;
}
