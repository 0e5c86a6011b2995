"""A.12 Cournot duopoly: bounds of actions are the only constraints.

Source: Facchinei and Kanzow (2010), preprint's appendix A.12; Krawczyk and Uryasev (2000).
Published: 16/3 for both, to five digits; to all digits it is 16 / (3 + 1e-5).
"""

PUBLISHED = [5.33331555561568, 5.33331555561568]


def cost(i, y, p):
    return y[i] * (y.sum() - 16)
