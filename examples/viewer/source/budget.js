// Limits the viewer's motion to positions for which the 3D photo has hidden surfaces. include/ldi/render/motion.hpp has the formula and its
// derivation.

/**
 * What the file says.
 *
 * @typedef {object} Budget
 * @property {number} motion  by what share of the photo's longer side what is nearest may move against what is farthest
 * @property {number} nearest  the distances which that is said of; the photo itself need not reach them
 * @property {number} farthest
 * @property {number} halfWidth  half the photo's width at distance 1
 * @property {number} halfHeight
 */

/**
 * @typedef {object} Position  of the viewer, from the place of the photo, in the photo's units; z towards the viewer
 * @property {number} x
 * @property {number} y
 * @property {number} z
 */

/** How near, of the way to what is nearest, one may come whatever the photo hides. */
const closest = 0.99;

/** @param {any} extras  of the file's scene @returns {Budget | null} */
export function readBudget({ motion, nearest, farthest }, halfWidth, halfHeight) {
    const isGiven = motion >= 0 && nearest > 0 && farthest >= nearest;
    return isGiven ? { motion, nearest, farthest, halfWidth, halfHeight } : null;
}

/** What a viewer there uncovers but for the factor that comes with going in, as a share of the photo's longer side. */
function across({ x, y, z }, { halfWidth, halfHeight, nearest, farthest }) {
    const moved = Math.hypot(Math.abs(x) + Math.abs(z) * halfWidth, Math.abs(y) + Math.abs(z) * halfHeight);
    return (moved * (1 / nearest - 1 / farthest)) / (2 * Math.max(halfWidth, halfHeight));
}

/**
 * By what share of the photo's longer side a viewer there moves what is nearest against what is farthest, where that is most.
 *
 * @param {Position} position
 * @param {Budget} budget
 */
export function motionOf(position, budget) {
    const forward = Math.max(-position.z, 0);
    return forward < budget.nearest ? (across(position, budget) * budget.nearest) / (budget.nearest - forward) : Infinity;
}

/** How far a viewer may go sideways. @param {Budget} budget */
export function asideWithin({ motion, nearest, farthest, halfWidth, halfHeight }) {
    return (2 * motion * Math.max(halfWidth, halfHeight)) / (1 / nearest - 1 / farthest);
}

/**
 * The place nearest to `position`, on the way there, that uncovers no more than the photo has.
 *
 * @param {Position} position
 * @param {Budget | null} budget
 * @returns {Position}
 */
export function withinMotion(position, budget) {
    if (!budget || motionOf(position, budget) <= budget.motion) return position;
    if (budget.motion === 0) return { x: 0, y: 0, z: 0 };
    const forward = Math.max(-position.z, 0);
    const scaled = (share) => ({ x: share * position.x, y: share * position.y, z: share * position.z });
    if (forward > closest * budget.nearest) return withinMotion(scaled((closest * budget.nearest) / forward), budget);
    return scaled((budget.motion * budget.nearest) / (across(position, budget) * budget.nearest + budget.motion * forward));
}
