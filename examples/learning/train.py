"""Train the policy of policy.py by an evolution strategy: CMA-ES, from the package cma.

The costs of whole episodes from random starts count, so nothing has to be differentiated; all
candidates of a generation run at once, in one vector of fleets. Some minutes on two cores.

    python examples/learning/train.py              # writes policy.json: without the barrier
    python examples/learning/train.py --guarded    # under it
"""

import argparse
import json
from pathlib import Path

import cma
import numpy as np
from policy import COUNT, FORCE, force

from gne_mj.environment import FleetVectorEnv, guarded, load_vector

CHANGES = {
    "simulation.control_period": 0.02, "simulation.duration": 5.0, "agents.input_limit": 40.0,
}  # fmt: skip
CANDIDATES = 16


def fleets(count: int, barrier: bool) -> FleetVectorEnv:
    """So many fleets, that begin anywhere inside."""
    environment = load_vector("velocity-sync", CHANGES, num_envs=count, start="random", spread=0.95)
    return guarded(environment, pull=FORCE) if barrier else environment


def returns(environment: FleetVectorEnv, numbers: np.ndarray, seed: int) -> np.ndarray:
    """What one episode of each fleet earned, under the policy of its row of numbers (E, COUNT)."""
    environment.reset(seed=seed)
    rows, going = environment.episodes.fleets.rows, np.ones(len(numbers), dtype=bool)
    earned = np.zeros(len(numbers))
    while np.any(going):
        _, rewards, left, over, _ = environment.step(force(numbers, rows.y))
        earned += np.where(going, rewards, 0.0)
        going &= ~(left | over)
    return earned


def train(generations: int, starts: int, barrier: bool, seed: int) -> np.ndarray:
    """The numbers of the best policy."""
    environment = fleets(CANDIDATES * starts, barrier)
    options = {"popsize": CANDIDATES, "seed": seed + 1, "verbose": -9}
    search, exits = cma.CMAEvolutionStrategy(np.zeros(COUNT), 0.5, options), 0
    for generation in range(generations):
        candidates = np.array(search.ask())
        # each candidate from the same starts, which are others in each generation
        numbers = np.repeat(candidates, starts, axis=0)
        seeds = np.tile(np.arange(starts) + starts * (generation + 1), CANDIDATES)
        earned = returns(environment, numbers, seeds.tolist()).reshape(CANDIDATES, starts)
        exits += sum(left is not None for left in environment.episodes.fleets.exits)
        search.tell(list(candidates), (-earned.mean(axis=1)).tolist())
        if generation % 10 == 9:
            best, episodes = earned.mean(axis=1).max(), (generation + 1) * len(numbers)
            print(f"{episodes} episodes, {exits} of them left: mean return {best:.1f}", flush=True)
    return np.asarray(search.result.xfavorite)


def judge(numbers: np.ndarray, barrier: bool, episodes: int) -> str:
    """How episodes from starts that were not trained on end, in words."""
    environment, inside, earned = fleets(min(episodes, 250), barrier), 0, []
    for first in range(0, episodes, environment.num_envs):
        given = np.broadcast_to(numbers, (environment.num_envs, COUNT))
        earned.append(returns(environment, given, 10**6 + first))
        exits = environment.episodes.fleets.exits
        inside += sum(left is None for left in exits)
    whole = np.concatenate(earned)
    return f"inside {inside} of {len(whole)}, mean return {whole.mean():.1f}"


def main() -> None:
    """Train, judge with and without the barrier, and keep the numbers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--generations", type=int, default=100)
    parser.add_argument("--starts", type=int, default=8)
    parser.add_argument("--episodes", type=int, default=1000, help="that it is judged by")
    parser.add_argument("--guarded", action="store_true", help="train under the barrier")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("policy.json"))
    options = parser.parse_args()
    numbers = train(options.generations, options.starts, options.guarded, options.seed)
    options.out.write_text(json.dumps([round(float(n), 4) for n in numbers]) + "\n")
    numbers = np.array(json.loads(options.out.read_text()))
    for barrier in (False, True):
        words = "under the barrier" if barrier else "without it"
        print(f"{words}: {judge(numbers, barrier, options.episodes)}")


if __name__ == "__main__":
    main()
