// The page of photo3d --batch --gallery: an element for each photo, a message for each failure, and a search in both.

import "./element.js";

const element = (id) => document.getElementById(id);

/** @type {{title: string, src?: string, poster?: string, page?: string, error?: string}[]} */
const photos = JSON.parse(element("photos")?.textContent ?? "[]");
const isFromDisk = location.protocol === "file:"; // pages opened from the disk can't fetch GLB files

function make(name, properties, ...children) {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
}

function entryOf({ title, src, poster, page, error }) {
    if (error !== undefined) return make("div", { className: "failed" }, make("strong", {}, title), error);
    const shown = document.createElement("photo-3d");
    for (const [name, value] of Object.entries({ loading: "lazy", poster, alt: title, caption: title, sway: "1", src: isFromDisk ? undefined : src }))
        if (value !== undefined) shown.setAttribute(name, value);
    const text = page ? make("a", { href: page }, title) : title;
    return make("figure", {}, shown, make("figcaption", {}, text));
}

const entries = photos.map((photo) => ({ photo, shown: entryOf(photo) }));
element("list").append(...entries.map(({ shown }) => shown));
element("note").hidden = !isFromDisk;

function search() {
    const words = element("search").value.toLowerCase().split(/\s+/);
    const hasFailuresOnly = element("failures").checked;
    let count = 0;
    for (const { photo, shown } of entries) {
        const text = `${photo.title} ${photo.error ?? ""}`.toLowerCase();
        const isFound = words.every((word) => text.includes(word)) && (!hasFailuresOnly || photo.error !== undefined);
        shown.hidden = !isFound;
        count += isFound ? 1 : 0;
    }
    const failed = photos.filter(({ error }) => error !== undefined).length;
    element("count").textContent = `${count} of ${photos.length} shown; ${photos.length - failed} photos converted, ${failed} failed`;
}

document.querySelector("form").addEventListener("input", search);
document.querySelector("form").addEventListener("submit", (event) => event.preventDefault());
search();
