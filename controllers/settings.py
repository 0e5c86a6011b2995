"""The numbers that every law is given, in one array for native code; these are its entries."""

RHO = 0  # barrier's penalty parameter rho
GAIN = 1  # k of [eq:CenterFeedback]
EPSILON = 2  # time constant of estimates and z in [eq:CenterFeedback], in s
COUNT = 3
