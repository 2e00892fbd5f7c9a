"""``python -m teamclone``, for launchers such as ``torchrun`` that want a module."""

from teamclone.cli import main

if __name__ == "__main__":
    main()
