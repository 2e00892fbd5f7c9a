"""What leaves Python: kernels as one C++17 header.

The header is made from the kernels that Python runs, so there is no second implementation to keep. `translate` goes
through a kernel's source; types follow Numba's rules, and each operation becomes C++ with the result that Numba has.
"""
