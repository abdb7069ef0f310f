"""Place of the compiled core for import rules and type checkers: `_core.pyi` has its types, `mmp_env.core` loads it."""

raise ImportError("import mmp_env.core: it loads the compiled variant of the native core that suits this processor")
