// Shows a 3D photo, and makes its page: the viewer of examples/viewer, filled as `photo3d --html` does.

import { readAsset, toBase64 } from "./assets.js";

/** @typedef {import("./converter.js").Photo3d} Photo3d */

const titleMarker = "<title>3D photo</title>";
const photoMarker = "<!-- the photo goes here -->";

let template;

const escapeHtml = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/"/g, "&quot;");

/** Returns the viewer's page with this content. @param {string} title  HTML @param {string} content  HTML */
async function pageAround(title, content) {
    template ??= new TextDecoder().decode(await readAsset("viewer.html"));
    const [beforeTitle, afterTitle] = template.split(titleMarker);
    const [head, tail] = afterTitle.split(photoMarker);
    return `${beforeTitle}<title>${title}</title>${head}${content}${tail}`;
}

/**
 * Returns a self-contained page.
 *
 * @param {Photo3d} photo
 * @param {string} title
 */
export function pageWith(photo, title) {
    const shown = escapeHtml(title);
    const content =
        `<photo-3d standalone caption="${shown}" alt="3D photo ${shown}" width="${photo.width}" height="${photo.height}"${photo.isPastFrame ? "" : ' frame="crop"'}>\n` +
        `<img slot="poster" alt="" src="data:image/jpeg;base64,${toBase64(photo.poster)}">\n</photo-3d>\n` +
        `<script id="photo" type="model/gltf-binary;base64">${toBase64(photo.glb)}</script>`;
    return pageAround(shown, content);
}

/** Loads the viewer into a frame. @param {HTMLIFrameElement} frame */
export async function loadViewer(frame) {
    const page = await pageAround("3D photo", "<photo-3d standalone></photo-3d>");
    await new Promise((resolve) => {
        frame.addEventListener("load", resolve, { once: true });
        frame.srcdoc = page;
    });
}

/**
 * Shows a 3D photo in a frame of loadViewer(). The 3D photo sways until the first touch.
 *
 * @param {HTMLIFrameElement} frame
 * @param {Photo3d} photo
 * @param {string} title
 * @returns {Promise<HTMLCanvasElement | null>} resolves to the canvas when the 3D photo is drawn, or to null if the viewer shows a message
 * instead
 */
export async function showPhoto(frame, photo, title) {
    const shown = frame.contentDocument.querySelector("photo-3d");
    shown.clear();
    URL.revokeObjectURL(shown.poster);
    const poster = URL.createObjectURL(new Blob([photo.poster], { type: "image/jpeg" }));
    Object.assign(shown, { poster, caption: title, alt: `3D photo ${title}` });
    for (const name of ["width", "height"]) shown.setAttribute(name, photo[name]);
    shown.setAttribute("frame", photo.isPastFrame ? "" : "crop");
    return (await frame.contentWindow.showPhoto(photo.glb)) ? shown.canvas : null;
}
