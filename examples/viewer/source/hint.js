// The hint on first use. One photo of a page shows it, until the person has used a photo once.

const key = "photo-3d-hint";
const seconds = 6;
let isShown = false;

/** Whether this person has already looked around in a photo. Sandboxed frames and private windows have no storage to remember this. */
function wasSeen() {
    try {
        return localStorage.getItem(key) !== null;
    } catch {
        return false;
    }
}

/** Stores that the user knows how to look around. */
export function noteUse() {
    if (isShown === "used") return;
    isShown = "used";
    try {
        localStorage.setItem(key, "seen");
    } catch {
        // without storage, the hint will appear again on the next visit
    }
}

/**
 * @param {HTMLElement} hint
 * @param {{isAlone: boolean, isReduced: boolean}} how
 */
export function offerHint(hint, { isAlone, isReduced }) {
    if (isShown || wasSeen()) return;
    isShown = true;
    const isTouched = matchMedia("(hover: none)").matches;
    const looks = isTouched && !isReduced ? "Drag or tilt to look around" : isTouched || isReduced ? "Drag to look around" : "Move the mouse to look around";
    hint.textContent = isAlone ? `${looks}, ${isTouched ? "pinch" : "scroll"} to zoom` : looks;
    hint.hidden = false;
    setTimeout(() => (hint.hidden = true), 1000 * seconds);
}
