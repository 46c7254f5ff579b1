import threading
import time

import pytest

from airborne.run.drawing import DrawingThread


def test_times_are_drawn_in_their_order_in_another_thread():
    drawn = []
    with DrawingThread(lambda n: drawn.append((n, threading.get_ident()))) as drawing:
        for n in range(20):
            drawing.put(n)
    assert [n for n, _ in drawn] == list(range(20))
    assert {thread for _, thread in drawn}.isdisjoint({threading.get_ident()})


def test_the_tracker_is_never_more_than_a_few_times_ahead():
    drawn, ahead = [], []
    with DrawingThread(lambda n: (time.sleep(0.002), drawn.append(n))) as drawing:
        for n in range(30):
            drawing.put(n)
            ahead.append(n + 1 - len(drawn))
    assert max(ahead) <= 5
    assert len(drawn) == 30


def fail(n):
    if n == 2:
        raise OSError("the disk is full")


def test_an_error_of_the_drawing_is_raised():
    with pytest.raises(OSError, match="full"), DrawingThread(fail) as drawing:
        for n in range(3):
            drawing.put(n)


def test_an_error_of_the_tracking_is_not_replaced_by_one_of_the_drawing():
    with pytest.raises(KeyboardInterrupt), DrawingThread(fail) as drawing:
        drawing.put(2)
        raise KeyboardInterrupt
