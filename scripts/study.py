"""Settings of the study of the paper's claims: the preset `paper` with other values of its options."""

from __future__ import annotations

from dataclasses import dataclass

ALPHAS = ("1e-8", "1e-7", "1e-6", "1e-5", "1e-4", "1e-3", "1e-2")
RANGES = {"centre": ("0.1", "0.2", "0.4"), "surface": ("0.05", "0.1", "0.2")}
"""Influence distances d_0 [m] of each kind of distance."""
ITERATIONS = ("10", "50", "250")
RADII = ("0.05", "0.1", "0.2", "0.4", "0.8")
"""Radii of the ball of the vertex constraint [rad]."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Values of the options that the study varies; the defaults are those of the preset `paper`."""

    distance: str = "centre"
    d0: str = "0.1"
    alpha: str = "1e-7"
    iterations: str = "50"
    radius: str = "0.2"

    @property
    def label(self) -> str:
        """Returns the label of the planner with this setting."""
        iterations = "" if self.iterations == Setting.iterations else f"-n{self.iterations}"
        return f"{self.distance}-{self.d0}-{self.alpha}{iterations}{_of_radius(self.radius)}"

    @property
    def options(self) -> str:
        """Returns the options of `apf-ecbs`. Between surfaces the force needs a floor, since it has no bound there."""
        values = f"d0={self.d0} alpha={self.alpha} max_iterations={self.iterations} radius={self.radius}"
        return f"preset=paper distance={self.distance}{self.floor} {values}"

    @property
    def floor(self) -> str:
        """Returns the option of the floor, which replaces that of the preset between surfaces."""
        return " floor=0.01" if self.distance == "surface" else ""

    @property
    def baseline(self) -> str:
        """Returns the label of `ecbs` with the same setting, but without repulsion."""
        return f"ecbs-paper{_of_radius(self.radius)}"


def _of_radius(radius: str) -> str:
    return "" if radius == Setting.radius else f"-r{radius}"


SURFACES = Setting(distance="surface")
"""The paper's values, with distances between surfaces."""
LARGER_STEPS = Setting(d0="0.2", alpha="1e-4")
"""A setting whose steps are large enough to resolve conflicts."""


def steps(distance: str) -> list[list[Setting]]:
    """Returns a row of settings for each d_0, with every alpha."""
    return [[Setting(distance=distance, d0=d0, alpha=alpha) for alpha in ALPHAS] for d0 in RANGES[distance]]


def iterations() -> list[list[Setting]]:
    """Returns a row of settings for each d_0 between centres, with every number of iterations."""
    return [[Setting(d0=d0, alpha="1e-5", iterations=n) for n in ITERATIONS] for d0 in RANGES["centre"]]


def radii() -> list[list[Setting]]:
    """Returns a row of settings for the paper's steps and for larger ones, with every radius."""
    return [
        [Setting(d0=step.d0, alpha=step.alpha, radius=radius) for radius in RADII] for step in (Setting(), LARGER_STEPS)
    ]


def study_variants(baseline: str) -> dict[str, str]:
    """Returns the options of each label of the study. `baseline`: those of `ecbs`, apart from the radius."""
    grids = [*steps("centre"), *steps("surface"), *iterations(), *radii()]
    settings = dict.fromkeys(setting for row in grids for setting in row)
    baselines = {setting.baseline: f"{baseline} radius={setting.radius}" for setting in settings}
    return baselines | {setting.label: setting.options for setting in settings}


def long_variants(baseline: str) -> dict[str, str]:
    """Returns the options of each label of the study with long time limits."""
    return {Setting().baseline: baseline} | {s.label: s.options for s in (Setting(), SURFACES)}
