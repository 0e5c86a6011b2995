"""What the paper proves of a law, as the law says it of itself."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LawTheorem:
    """A theorem in continuous time, and what kind of conditions :mod:`gne_mj.theory` checks for it.

    Attributes:
        name: lemma and theorem, by the paper's labels.
        strong: F must be strongly monotone [asmp:pseudo(b)], not only strictly [asmp:pseudo(a)].
        at_estimates: F is evaluated at estimates, so that its constants are needed where these can
            be, and the coupling gain must exceed what they ask for.
        singular_perturbation: estimates and z are fast. The theorem is for every epsilon below one
            that it does not compute (:mod:`gne_mj.theory.epsilon_star` does), and asks for
            k > beta / mu [asmp:OSSPassive].
    """

    name: str
    strong: bool = False
    at_estimates: bool = False
    singular_perturbation: bool = False
