"""The native core: the names of the compiled variant that suits this processor; what they are stands in `_core.pyi`."""

from mmp_env import core_variants

globals().update(
    {k: v for k, v in vars(core_variants.load(core_variants.preferred())).items() if not k.startswith("_")}
)
