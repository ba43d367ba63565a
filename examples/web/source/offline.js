// Service worker: caches the page and its files, so that they work offline after the first visit. From the second visit on, it isolates the
// page from other sites, by the headers that a server could send, because browsers allow threads only on isolated pages. bundle.mjs inserts
// the names of the files and a version of their content.

// The service worker caches the HEIC reader after the first photo that needs it. It does not touch other pages and files of the server.

/** Beginning of the names of this page's caches. Other copies of the page on the same server have other scopes. */
const prefix = `photo3d ${registration.scope} `;
const version = prefix + "VERSION";
const files = ["FILES"];
const heicFiles = ["HEIC"];
const addresses = new Set([...files, ...heicFiles].map((name) => new URL(name, registration.scope).href));

/**
 * Requests the server's version of a file, because the browser's own cache may contain an older one under the same name. The server does
 * not send again what the browser has.
 */
const newest = (name) => new Request(name, { cache: "no-cache" });

addEventListener("install", (event) => {
    event.waitUntil(
        caches
            .open(version)
            .then((cache) => cache.addAll(files.map(newest)))
            .then(() => skipWaiting()),
    );
});

addEventListener("activate", (event) => {
    const isOld = (name) => name.startsWith(prefix) && name !== version;
    event.waitUntil(caches.keys().then((names) => Promise.all(names.filter(isOld).map((name) => caches.delete(name)))));
    event.waitUntil(clients.claim());
});

/** Returns the response with headers that isolate a page. */
function isolated(response) {
    const headers = new Headers(response.headers);
    headers.set("Cross-Origin-Opener-Policy", "same-origin");
    headers.set("Cross-Origin-Embedder-Policy", "require-corp");
    return new Response(response.body, { status: response.status, statusText: response.statusText, headers });
}

async function answer(request) {
    const cache = await caches.open(version);
    const kept = await cache.match(request, { ignoreSearch: true });
    const isPart = request.url.endsWith(".gz");
    const response = kept ?? (await fetch(isPart ? newest(request.url) : request));
    if (!kept && response.ok && isPart) await cache.put(request, response.clone()).catch(() => {}); // no space
    return request.mode === "navigate" && response.ok ? isolated(response) : response;
}

addEventListener("fetch", (event) => {
    if (addresses.has(event.request.url.replace(/[?#].*/, ""))) event.respondWith(answer(event.request));
});
