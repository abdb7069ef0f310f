# %% [markdown]
# # What repulsion saves: the tree of `ecbs` beside that of `apf-ecbs`
#
# The same eight arms, the same start and goal, the same seed. Both planners grow a conflict tree: every node holds one
# path for each arm, and where two arms meet it is branched, each branch keeping one of them out of the way. `apf-ecbs`
# also pushes paths apart after each replanning, and tries whether pushing one arm aside ends all conflicts at once.
#
# Run it as a script, or cell by cell in an editor that knows such cells. It writes `ecbs.svg` and `apf-ecbs.svg` into
# the folder that it is run in.

# %%
import gymnasium as gym

import mmp_planners
from mmp_env.view.search_tree import SearchTree

env = gym.make("mmp_env:MultiArmCell-8")
env.reset(seed=3)
problem = env.unwrapped.problem

# %%
trees, results = {}, {}
for name in ("ecbs", "apf-ecbs"):
    trees[name] = SearchTree(problem, title=f"{name} on {problem.name}")
    results[name] = mmp_planners.make(name).plan(problem, seed=3, time_limit=60.0, watch=trees[name])

# %%
for name, tree in trees.items():
    result = results[name]
    counts = f"{len(tree.nodes)} nodes, {len(tree.expansions)} expanded, {len(tree.roots)} trees"
    print(f"{name:9} {result.status}: {counts}, {result.plan.cost_rad:.2f} rad")
    tree.save(f"{name}.svg")

# %% [markdown]
# What the way to the solution was, step by step.

# %%
for node in trees["apf-ecbs"].solution_path:
    apart = node.constraint or ("fast track" if node.fast_track else "the arms on their own")
    print(f"{node.conflicts:4} conflicts, {node.cost_rad:7.2f} rad: {apart}")

# %%
trees["ecbs"]

# %%
trees["apf-ecbs"]
