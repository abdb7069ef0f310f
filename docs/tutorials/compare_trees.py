# %% [markdown]
# # Compare two conflict trees: `ecbs` and `apf-ecbs`
#
# Both planners solve the same instance of eight arms with the same seed. Both grow a conflict tree: every node holds
# one path for each arm, and each branch forbids one arm its part of a conflict. `apf-ecbs` also pushes paths apart
# after each replanning, and tests whether pushing a single arm aside resolves all conflicts.
#
# Run it as a script, or cell by cell in an editor that supports `# %%` cells. It writes `ecbs.svg` and `apf-ecbs.svg`
# into the current folder.

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
# The path to the solution, step by step:

# %%
for node in trees["apf-ecbs"].solution_path:
    apart = node.constraint or ("fast track" if node.fast_track else "root: every arm alone")
    print(f"{node.conflicts:4} conflicts, {node.cost_rad:7.2f} rad: {apart}")

# %%
trees["ecbs"]

# %%
trees["apf-ecbs"]
