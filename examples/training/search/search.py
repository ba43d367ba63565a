"""Searches the design space for accurate networks within latency limits. See README.md.

    python3 search.py --latency PROGRAM --members members.json --out FOLDER [--measure]

Writes result.json and pareto.png to FOLDER. Reads the latency table from FOLDER/latency.json; if the file is missing, or with --measure,
measures the table with latency.cpp and writes it.
"""
import argparse
import json
import os
import subprocess

import numpy as np

import space
import model

LIMITS = (0.6, 0.7, 0.8, 0.9, 1.0, 1.25)  # latency limits, relative to the shipped network
RIDGES = (0.1, 0.3, 1, 3, 10, 30)


def name_of(signature):
    return " ".join(map(str, signature))


def description(blocks):
    height, width = blocks.sizes["photo"]
    return {"height": height, "width": width, "channels": blocks.channels["photo"], "operators": space.rows_of(blocks)}


def measured(program, networks, rounds):
    """Runs latency.cpp on {name: Blocks}. Returns {"isa": name, "milliseconds": {name: time}}."""
    text = json.dumps({name: description(blocks) for name, blocks in networks.items()})
    return json.loads(subprocess.run([program, str(rounds)], input=text, capture_output=True, text=True, check=True).stdout)


def measure_table(program, path, members, rounds):
    """Measures the table of all blocks and, in the same rounds, whole networks for comparison with the sums of their blocks."""
    networks = {name_of(s): space.alone(s) for s in space.all_signatures()}
    networks.update({f"whole {i}": space.built(m) for i, m in enumerate(members)})
    found = measured(program, networks, rounds)
    times = found["milliseconds"]
    whole = [{"member": m, "measured": times.pop(f"whole {i}")} for i, m in enumerate(members)]
    for w in whole:
        w["sum"] = round(latency(times, w["member"]), 4)
    with open(path, "w") as file:
        json.dump({"isa": found["isa"], "rounds": rounds, "input": [space.HEIGHT, space.WIDTH], "whole": whole, "milliseconds": times}, file, indent=0)


def latency(table, member):
    return sum(table[name_of(s)] for s in space.built(member).signatures)


def features(member):
    """Returns the predictor's features: logarithms of sizes, shares, depths and widths."""
    blocks = space.built(member)
    g = dict(zip(space.NAMES, member))
    parameters, products = model.costs(ops=blocks.operators)
    down = [i for i in range(len(space.DOWN))]
    up = [i + 1 for i in range(len(space.UP))]
    refined = [g[f"up{i}.blocks"] for i in up]
    return np.array([
        np.log(products), np.log(parameters),
        np.mean([np.log(g[f"down{i}.channels"]) for i in down]), np.mean([np.log(g[f"up{i}.channels"]) for i in up]),
        np.mean([np.log(g[f"down{i}.expansion"]) for i in down]), np.log(sum(g[f"down{i}.blocks"] for i in down)),
        np.mean([g[f"down{i}.kernel"] == 3 for i in down]), float(sum(refined)),
        sum(n for i, n in zip(up, refined) if g[f"up{i}.refine"] == "dense") / max(1, sum(refined)),
        float(sum(refined[:2])), np.log(g["up0.channels"])])


def error_of(result):
    """Returns the mean of a training run's errors on held-out photographs and on pictures with measured depth. The second may be
    missing."""
    return result["error"] if result["measured_error"] is None else (result["error"] + result["measured_error"]) / 2


class Ridge:
    """Ridge regression on standardized features, with leave-one-out predictions in closed form."""

    def __init__(self, x, y, ridge):
        self.mean, self.scale = x.mean(0), x.std(0) + 1e-9
        a = np.c_[np.ones(len(x)), (x - self.mean) / self.scale]
        penalty = np.diag([0.0] + [ridge] * x.shape[1])
        inverse = np.linalg.inv(a.T @ a + penalty)
        self.weights = inverse @ a.T @ y
        hat = np.einsum("ij,jk,ik->i", a, inverse, a)
        self.left_out = y - (y - a @ self.weights) / (1 - hat)

    def __call__(self, x):
        return np.c_[np.ones(len(x)), (x - self.mean) / self.scale] @ self.weights


def ranks(values):
    return np.argsort(np.argsort(values)).astype(float)


def correlations(a, b):
    """Returns [Pearson's, Spearman's correlation]."""
    return [round(float(np.corrcoef(x, y)[0, 1]), 3) for x, y in ((a, b), (ranks(a), ranks(b)))]


def fitted(results):
    """Returns (error predictor, its quality, {member: leave-one-out prediction})."""
    used = [r for r in results if r["role"] == "sample"]
    x, y = np.array([features(tuple(r["member"])) for r in used]), np.array([error_of(r) for r in used])
    best = min((Ridge(x, y, ridge) for ridge in RIDGES), key=lambda r: np.mean((r.left_out - y) ** 2))
    by_size = Ridge(x[:, :1], y, 0.1)  # baseline: multiplications alone
    again = [error_of(r) for r in results if tuple(r["member"]) == space.SHIPPED]
    quality = {
        "members": len(used), "steps": used[0]["steps"], "error_mean": round(float(y.mean()), 5), "error_std": round(float(y.std()), 5),
        "left_out_rmse": round(float(np.sqrt(np.mean((best.left_out - y) ** 2))), 5), "left_out_correlation": correlations(best.left_out, y),
        "left_out_correlation_of_multiplications_alone": correlations(by_size.left_out, y),
        "std_between_seeds": round(float(np.std(again, ddof=1)), 5) if len(again) > 1 else None}
    with_depth = [r for r in used if r["measured_error"] is not None]
    if len(with_depth) > 2:
        quality["correlation_of_both_errors"] = correlations([r["error"] for r in with_depth], [r["measured_error"] for r in with_depth])
    return best, quality, dict(zip((tuple(r["member"]) for r in used), best.left_out))


def evolved(rng, table, predictor, limit, generations, population=48):
    """Returns the member with the minimum predicted error within a latency limit. Starts from the shipped member and random members; each
    generation replaces the worse half of the population with mutations and crossovers of the better half."""
    known = {}

    def judge(members):
        for m in members:
            if m not in known:
                time = latency(table, m)
                known[m] = (predictor(features(m)[None])[0] if time <= limit else 10 + time, time)
    pool = [space.SHIPPED] + [space.random_member(rng) for _ in range(population - 1)]
    for _ in range(generations):
        judge(pool)
        pool = sorted(dict.fromkeys(pool), key=lambda m: known[m][0])[:population // 2]
        children = [space.mutated(rng, space.crossed(rng, pool[rng.integers(len(pool))], pool[rng.integers(len(pool))]))
                    for _ in range(population - len(pool))]
        pool += children
    judge(pool)
    best = min(known, key=lambda m: known[m][0])
    return best, *known[best], len(known)


def draw(path, table, results, front, predictor, quality):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), dpi=90)
    rng = np.random.default_rng(5)
    cloud = [space.random_member(rng) for _ in range(400)]
    left.plot([latency(table, m) for m in cloud], predictor(np.array([features(m) for m in cloud])), ".", color="0.8", markersize=4,
              label="random members, predicted")
    for role, style, label in (("sample", "ko", "trained members"), ("found", "r*", "found networks, trained")):
        points = [(latency(table, tuple(r["member"])), error_of(r)) for r in results if r["role"] == role]
        if points:
            left.plot(*zip(*points), style, markersize=9 if role == "found" else 4, label=label)
    left.plot([f["latency"] for f in front], [f["predicted_error"] for f in front], "r.-", label="found networks, predicted")
    shipped = [error_of(r) for r in results if tuple(r["member"]) == space.SHIPPED]
    left.plot([latency(table, space.SHIPPED)] * len(shipped), shipped, "bs", markersize=6, label="shipped network, same brief training")
    left.set_xlabel("milliseconds on one core (table)")
    left.set_ylabel("error")
    left.legend(fontsize=8)
    used = [r for r in results if r["role"] == "sample"]
    right.plot([quality[tuple(r["member"])] for r in used], [error_of(r) for r in used], "ko", markersize=4)
    low, high = right.get_ylim()
    right.plot([low, high], [low, high], "0.7", linewidth=1)
    right.set_xlabel("predicted without this member (leave one out)")
    right.set_ylabel("error")
    figure.tight_layout()
    figure.savefig(path)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("latency", "members", "out"):
        p.add_argument("--" + name, required=True)
    p.add_argument("--rounds", type=int, default=5)
    p.add_argument("--generations", type=int, default=60)
    p.add_argument("--measure", action="store_true", help="measure the table again, even if latency.json exists")
    a = p.parse_args()
    os.makedirs(a.out, exist_ok=True)
    path = os.path.join(a.out, "latency.json")
    if a.measure or not os.path.exists(path):
        rng = np.random.default_rng(2)
        measure_table(a.latency, path, [space.SHIPPED] + [space.random_member(rng) for _ in range(7)], a.rounds)
    with open(path) as file:
        stored = json.load(file)
    table, whole = stored["milliseconds"], stored["whole"]
    ratios = [w["measured"] / w["sum"] for w in whole]
    print(f"latency table: {len(table)} blocks, {stored['isa']}. {len(whole)} whole networks take {min(ratios):.2f} to {max(ratios):.2f} of their "
          f"sums (mean {np.mean(ratios):.2f}); correlation {correlations([w['measured'] for w in whole], [w['sum'] for w in whole])[0]}")

    with open(a.members) as file:
        results = json.load(file)
    predictor, quality, left_out = fitted(results)
    print(f"predictor: {json.dumps(quality)}")

    shipped, front = latency(table, space.SHIPPED), []
    for limit in LIMITS:
        member, error, time, seen = evolved(np.random.default_rng(3), table, predictor, limit * shipped, a.generations)
        if time > limit * shipped:
            print(f"limit {limit:.2f} x shipped: no member found")
            continue
        parameters, products = model.costs(ops=space.built(member).operators)
        front.append({"limit": limit, "latency": round(time, 3), "predicted_error": round(float(error), 5), "parameters": parameters,
                      "products": products, "seen": seen, "member": member})
        print(f"limit {limit:.2f} x shipped: {time:.2f} ms, predicted error {error:.4f}, {products / 1e9:.2f} GMAC, {parameters / 1e6:.2f} M "
              f"parameters, {seen} members seen")
    print(f"shipped: {shipped:.2f} ms, predicted error {predictor(features(space.SHIPPED)[None])[0]:.4f}")
    with open(os.path.join(a.out, "result.json"), "w") as file:
        text = {"space": space.size(), "genes": space.NAMES, "shipped": {"latency": round(shipped, 3), "member": space.SHIPPED}, "predictor": quality}
        file.write(json.dumps(text, indent=1)[:-2] + ',\n "front": [\n  ' + ",\n  ".join(json.dumps(f) for f in front) + "\n ]\n}\n")
    draw(os.path.join(a.out, "pareto.png"), table, results, front, predictor, left_out)


if __name__ == "__main__":
    main()
