"""The application: the window, the command line, and what wires core, tools and viewport together."""

import os

# Our own workers share out what is large; the linear algebra left is small, and slower on several threads than on one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
