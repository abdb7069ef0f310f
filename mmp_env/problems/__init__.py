"""Makes validated problems: resolves goals to configurations, and checks limits, collisions and margins."""
