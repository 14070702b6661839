"""The methods there are, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from prediction.errors import UnsupportedMethodError
from prediction.laws.cov_ik import CovIk
from prediction.laws.gaussian_laws import MinimumNormIk, SbM, WIk
from prediction.laws.joint_process import CcGp, Gp
from prediction.laws.locov_ik import LoCovIk
from prediction.laws.mi_nsgp import MiNsGp, NsGp
from prediction.laws.predictor import Predictor
from prediction.laws.promp import ProMp

#: Every method; the baselines are always trained and shown beside any other.
METHODS: Mapping[str, type[Predictor]] = MappingProxyType(
    {
        cls.name: cls
        for cls in (MiNsGp, CovIk, MinimumNormIk, LoCovIk, CcGp, NsGp, WIk, SbM, Gp, ProMp)
    }
)
BASELINES: tuple[str, ...] = (CovIk.name, MinimumNormIk.name)
#: Asked for instead of a method: train the candidates and take what held-out motion prefers.
AUTO = "auto"
CANDIDATES: tuple[str, ...] = (MiNsGp.name, LoCovIk.name, CcGp.name, CovIk.name)


def method_class(name: str) -> type[Predictor]:
    """Returns the class of a method.

    Raises:
        UnsupportedMethodError: There is none of that name.
    """
    if name not in METHODS:
        raise UnsupportedMethodError("method", name, tuple(METHODS))
    return METHODS[name]
