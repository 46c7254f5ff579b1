import os

for threads in ("OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):  # else libraries fight with the workers for cores
    os.environ.setdefault(threads, "1")
