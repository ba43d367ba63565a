// Schedules the loading of a page's photos. Photos near the window load one at a time, the nearest first, and not while the page scrolls.
// If a server is slow, the next photo also starts to load.

import { stage } from "./stage.js";

/** Milliseconds to wait after the last scroll event. */
const calm = 120;

/** Milliseconds after which the next photo loads even if a slow server has not delivered this one. */
const patience = 3000;

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/**
 * An element whose photo is waiting to load.
 *
 * @typedef {object} Waiting
 * @property {() => number} distance  from the middle of the window, in pixels
 * @property {() => Promise<void>} load  never rejects
 */

/** @type {Set<Waiting>} */
const waiting = new Set();
let isLoading = false;

/** @param {Waiting} entry */
export function enqueue(entry) {
    waiting.add(entry);
    next();
}

/** @param {Waiting} entry */
export function withdraw(entry) {
    waiting.delete(entry);
}

async function next() {
    if (isLoading) return;
    isLoading = true;
    while (waiting.size > 0) {
        const rest = calm - (performance.now() - (stage.scrollTime ?? -Infinity));
        if (rest > 0) {
            await pause(rest);
            continue;
        }
        const nearest = [...waiting].reduce((a, b) => (b.distance() < a.distance() ? b : a));
        waiting.delete(nearest);
        await Promise.race([nearest.load(), pause(patience)]);
        await pause(0); // lets the page run other tasks
    }
    isLoading = false;
}

/**
 * Listeners of an element.
 *
 * @typedef {object} Watcher
 * @property {(isInSight: boolean, share: number) => void} sightChanged  share of the element in the window
 * @property {(isNear: boolean) => void} nearnessChanged
 */

/** @type {WeakMap<Element, Watcher>} */
const watchers = new WeakMap();

/** @type {IntersectionObserver[]} */
let observers;

function makeObservers() {
    const observe = (rootMargin, threshold, tell) =>
        new IntersectionObserver((entries) => entries.forEach((entry) => tell(watchers.get(entry.target), entry)), { rootMargin, threshold });
    return [
        observe("0px", [0, 0.5], (watcher, { isIntersecting, intersectionRatio }) => watcher.sightChanged(isIntersecting, intersectionRatio)),
        observe("60% 0px", 0, (watcher, { isIntersecting }) => watcher.nearnessChanged(isIntersecting)),
    ];
}

/** @param {Element} element @param {Watcher} watcher */
export function watch(element, watcher) {
    watchers.set(element, watcher);
    observers ??= makeObservers();
    for (const observer of observers) observer.observe(element);
}

/** @param {Element} element */
export function unwatch(element) {
    for (const observer of observers) observer.unobserve(element);
}
