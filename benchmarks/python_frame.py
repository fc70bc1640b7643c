"""What Python adds to a frame of the tracked body. Decides no test.

Sample run, with the module's folder in PYTHONPATH:  python3 python_frame.py SCENE RECORDING
Prints the medians of a step's time, of the engine's part, of their difference, and their ratio.
"""

import statistics
import sys
import time

import livetet

scene = livetet.Scene.load(sys.argv[1])
recording = livetet.Recording.load(sys.argv[2])
body = livetet.TrackedBody(scene, recording.tools)
whole, engine = [], []
for k in range(len(recording)):
    poses, at = recording[k].poses, recording[k].time
    while body.work_on_responses():
        pass
    start = time.perf_counter()
    frame = body.step(poses, at)
    frame.displacement[0, 0]
    whole.append(1e3 * (time.perf_counter() - start))
    engine.append(1e3 * frame.seconds)
added = [w - e for w, e in zip(whole, engine)]
median = statistics.median
print(f"{len(whole)} frames of {len(body.mesh.points)} nodes, medians")
print(f"step {median(whole):.3f} ms, engine {median(engine):.3f} ms, added {median(added):.4f} ms")
print(f"ratio {median(whole) / median(engine):.4f}; limit of what is added: 0.1 ms")
