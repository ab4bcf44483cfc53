"""How fast jet_gym is, beside what one would take instead: ``python -m benchmarks`` runs everything.

Each benchmark runs alone too, such as ``python -m benchmarks.postures``.
Libraries get one thread each, which has to be said before NumPy loads.
"""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
