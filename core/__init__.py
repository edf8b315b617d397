"""The headless model layer. Importing it only says where compiled kernels are kept (see core/kernel_cache.py)."""

from core.kernel_cache import use_kernel_cache

use_kernel_cache()
