"""From the inputs to the answer of a network of any family: its layers, its heads, and numbers drawn from its answer.

`spec` says what a network is made of and where each number stands, `answer` computes, `network` is for Python,
`weights` for files. All kernels are in single precision, geometry between them in double precision.
"""
