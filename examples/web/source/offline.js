// Service worker: keeps the page and its files, so that they work without a network after the first visit. bundle.mjs fills in the
// names of the files and a version of their content.

const version = "VERSION";
const files = ["FILES"];

addEventListener("install", (event) => {
    event.waitUntil(
        caches
            .open(version)
            .then((cache) => cache.addAll(files))
            .then(() => skipWaiting()),
    );
});

addEventListener("activate", (event) => {
    const isOld = (name) => name.startsWith("photo3d ") && name !== version;
    event.waitUntil(caches.keys().then((names) => Promise.all(names.filter(isOld).map((name) => caches.delete(name)))));
    event.waitUntil(clients.claim());
});

addEventListener("fetch", (event) => {
    event.respondWith(caches.open(version).then((cache) => cache.match(event.request, { ignoreSearch: true })).then((kept) => kept ?? fetch(event.request)));
});
