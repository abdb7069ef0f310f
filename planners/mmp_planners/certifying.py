"""The proof that comes with a plan, under the name that planners know it by: see `mmp_env.certificate`."""

from mmp_env.certificate import SHARE, Certificate, certify

__all__ = ["SHARE", "Certificate", "certify"]
