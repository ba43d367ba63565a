// Limits the viewer's motion to positions for which the 3D photo has hidden surfaces. include/ldi/render/motion.hpp has the formula and its
// derivation.

/**
 * The motion limits in the file.
 *
 * @typedef {object} Budget
 * @property {number} motion  maximum parallax between the nearest and the farthest surface, as a share of the photo's long side
 * @property {number} nearest  lower bound of the surfaces' distances; `motion` refers to surfaces at both bounds
 * @property {number} farthest  upper bound
 * @property {number} halfWidth  half the photo's width at distance 1
 * @property {number} halfHeight
 */

/**
 * @typedef {object} Position  of the viewer, relative to the photo's camera, in the photo's units; z points toward the viewer
 * @property {number} x
 * @property {number} y
 * @property {number} z
 */

/** Maximum distance that the viewer may approach, as a share of the distance to the nearest surface, regardless of hidden surfaces. */
const closest = 0.99;

/** @param {any} extras  of the file's scene @returns {Budget | null} */
export function readBudget({ motion, nearest, farthest }, halfWidth, halfHeight) {
    const isGiven = motion >= 0 && nearest > 0 && farthest >= nearest;
    return isGiven ? { motion, nearest, farthest, halfWidth, halfHeight } : null;
}

/** Returns the parallax at a position, as a share of the photo's long side, without the magnification that moving closer adds. */
function across({ x, y, z }, { halfWidth, halfHeight, nearest, farthest }) {
    const moved = Math.hypot(Math.abs(x) + Math.abs(z) * halfWidth, Math.abs(y) + Math.abs(z) * halfHeight);
    return (moved * (1 / nearest - 1 / farthest)) / (2 * Math.max(halfWidth, halfHeight));
}

/**
 * Returns the maximum parallax between the nearest and the farthest surface at a position, as a share of the photo's long side.
 *
 * @param {Position} position
 * @param {Budget} budget
 */
export function motionOf(position, budget) {
    const forward = Math.max(-position.z, 0);
    return forward < budget.nearest ? (across(position, budget) * budget.nearest) / (budget.nearest - forward) : Infinity;
}

/** Returns the maximum sideways distance of the viewer within the budget. @param {Budget} budget */
export function asideWithin({ motion, nearest, farthest, halfWidth, halfHeight }) {
    return (2 * motion * Math.max(halfWidth, halfHeight)) / (1 / nearest - 1 / farthest);
}

/**
 * Moves a position toward the photo's viewpoint, if necessary, until it is within the budget.
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
