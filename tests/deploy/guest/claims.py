"""The claims about a run, with their figures. Each function takes a Run and a Report."""
import re
import statistics

import spans
from notes import MS, SECOND


def near(value, wanted, by):
    return abs(value - wanted) <= by


def ms(ns):
    return f'{ns / MS:.2f} ms'


def the_guest_is_as_meant(run, report):
    facts, clock = run.read('facts'), run.read('clock')
    report.claim('sensors_failed' not in run.marks and 'flow' in run.marks, 'the guest has its sensors and its images')
    report.claim(run.read('user').strip() == 'perdure', f'capture runs as {run.read("user").strip()}, by its unit')
    report.claim(re.search(r'b +o +o +t +t +i +m +e +\\n', clock) is not None,
                 'capture has chosen boottime, and the kernel says it with a newline')
    report.claim('mount 0, -1, 0; 1, 0, 0; 0, 0, 1' in facts, 'the kernel says a mount matrix that is not the identity')


def controls_are_told(run, report):
    told = dict(re.findall(r'^set (\w+) (\d+)$', run.camera_log, re.M))
    report.claim(told.get('exposure_mode') == '1' and told.get('exposure_100us') == '100' and 'gain' in told,
                 f'the camera was told exposure and gain: {told}')


def images_are_counted(run, report):
    """Checks the first opening, up to the silence after which capture opens the camera again."""
    frames = [f for f in run.between(run.frames, 'booted', 'all_counted') if f.number <= (run.sent_before('silent') or 0)]
    after = [h for h in run.health_of('capture') if frames and h.heard > frames[-1].heard]
    if not frames or not after:
        return report.claim(False, 'no images, or no health')
    uneven = [(a.number, b.number) for a, b in zip(frames, frames[1:]) if b.number - a.number != b.sequence - a.sequence]
    report.claim(not uneven, f'between images as many numbers are missing as the camera sent ({uneven[:3]})')
    report.claim(all(b.stamp > a.stamp for a, b in zip(frames, frames[1:])), 'images come in their order')
    lost, sent = after[0].count('camera_frame_lost'), run.sent_before('silent') - frames[0].number + 1
    given = after[0].frames_in
    report.claim(given + lost == sent, f'{given} given + {lost} lost = {sent} sent, from the first one given on, which is the '
                 f'camera\'s number {frames[0].number}')
    report.claim(lost >= 6, 'what the driver lost and what was broken (the driver drops it) is among the lost')
    report.claim(len(frames) == given, f'{len(frames)} of {given} images were heard on the bus')


def flow_is_well(run, report):
    span = (run.marks['flow_ends'] - run.marks['flow']) / SECOND
    frames, samples = run.between(run.frames, 'flow', 'flow_ends'), run.between(run.samples, 'flow', 'flow_ends')
    report.claim(len(frames) > 5 * span, f'{len(frames)} images in {span:.1f} s of the guest, {len(frames) / span:.1f} a second')
    report.claim(len(samples) > 25 * span,
                 f'{len(samples)} inertial samples, {len(samples) / span:.1f} a second')
    for process in ('capture',):
        of = run.health_of(process, 'flow', 'flow_ends')
        bad = [h.message for h in of if h.state != 1]
        more = {k: v - of[0].reasons.get(k, 0) for k, v in of[-1].reasons.items() if v > of[0].reasons.get(k, 0)} if of else {}
        report.claim(of and not bad, f'{process} is well all the time ({len(of)} of its health; {bad[:1]})')
        report.claim(process != 'capture' or not set(more) - {'camera_frame_lost'}, f'{process} counts {more}')


def offsets_to(stamps, kernel):
    """Returns the difference of each stamp from the last time in `kernel` that is not later."""
    out, at = [], 0
    for stamp in stamps:
        while at + 1 < len(kernel) and kernel[at + 1] <= stamp:
            at += 1
        out.append(stamp - kernel[at])
    return out


def stamps_are_the_kernels(run, report):
    frames, samples = run.between(run.frames, 'flow', 'flow_ends'), run.between(run.samples, 'flow', 'flow_ends')
    if len(frames) < 2 or len(samples) < 2:
        return report.claim(False, 'there are no stamps')
    walls = [ahead for _, ahead in run.clocks]
    wall = run.wall
    report.claim(max(walls) - min(walls) < MS, f'the guest\'s wall clock goes with its monotonic one, within {ms(max(walls) - min(walls))}')
    for name, things in (('images', frames), ('samples', samples)):
        steps = [b.stamp - a.stamp for a, b in zip(things, things[1:])]
        report.claim(min(steps) > 0, f'stamps of {name} grow, by {ms(min(steps))} to {ms(max(steps))}, mostly {ms(statistics.median(steps))}')
        ages = [t.heard + wall - t.stamp for t in things]
        report.claim(min(ages) > 0, f'{name} are {ms(min(ages))} to {ms(max(ages))} old when they are heard, mostly {ms(statistics.median(ages))}')
    kernel = sorted(run.image_stamps)
    apart = [min((abs(f.stamp - wall - k), f.stamp - wall - k) for k in kernel)[1] for f in frames]
    middle = statistics.median(apart)
    report.claim(max(abs(a - middle) for a in apart) < MS and abs(middle) < 2 * MS,
                 f'images have the stamps of the kernel: {middle / 1e3:.0f} µs off, {(min(apart) - middle) / 1e3:.0f} to {(max(apart) - middle) / 1e3:+.0f} µs from that')
    after = sorted(offsets_to([s.stamp - wall for s in samples], run.triggers))
    share = after[int(.95 * len(after))]
    report.claim(-MS < after[0] and share < 2 * MS, f'samples are stamped {ms(after[0])} after the trigger at the earliest, 95 of 100 by {ms(share)}')
    triggers = run.between(run.triggers, 'flow', 'flow_ends', at=lambda t: t)
    report.claim(len(triggers) >= len(samples) - 10, f'{len(samples)} samples of {len(triggers)} triggers')
    report.claim(near(statistics.median(b.stamp - a.stamp for a, b in zip(samples, samples[1:])), 20 * MS, MS / 2),
                 'the trigger has the rate of imu.rate_hz')


def samples_are_mounted(run, report):
    if not run.samples:
        return report.claim(False, 'there are no samples')
    last = run.samples[-1]
    g, unit = 9.80665 / 16384, 0.0010642
    gyro, accel = (20 * unit, 10 * unit, 0), (0, 512 * g, 16384 * g)
    report.claim(all(near(a, b, 2e-3) for a, b in zip(last.gyro, gyro)) and all(near(a, b, 2e-2) for a, b in zip(last.accel, accel)),
                 f'axes are turned as the mount matrix says: {last.gyro} rad/s, {last.accel} m/s²')


def capture_lives(run, report, wanted):
    unplugged = [int(m[10:]) for m in run.marks if m.startswith('unplugged_')]
    report.claim(unplugged == [wanted] and 'end' in run.marks, f'{unplugged} of {wanted} unplugs')
    report.claim(run.read('restarts').strip() == '0', f'capture was started again {run.read("restarts").strip()} times')
    report.claim(run.read('status').strip() == '0', f'capture ends with {run.read("status").strip()}')
    cores = sorted(p.name for p in (run.folder / 'share').glob('core.*'))
    report.claim(not cores and 'segfault' not in run.read('dmesg'), f'nothing crashed {cores}')


def images_come_back(run, report):
    """Measured from the time at which udev reports the nodes, because they can be opened only
    then. Earlier delays are those of the emulator."""
    of = spans.comebacks(run)
    if not of:
        return
    own = [c.own() for c in of if c.own() is not None]
    whole = [c.heard - c.plug for c in of if c.heard is not None]
    print('\n'.join('       ' + line for line in spans.table(run, of)))
    early = sum(c.told is None for c in of)
    report.claim(own and max(own) <= spans.LIMIT, f'images are back within {max(own, default=0) / SECOND:.2f} s of udev, after {len(own)} of {len(of)} '
                 f'plugs; of the others {early} ended before udev had told, {len(of) - len(own) - early} soon after')
    print(f'       of the plug itself {sum(w <= spans.LIMIT for w in whole)} of {len(whole)} are within {spans.LIMIT / SECOND:.0f} s')
    frames = run.between(run.frames, 'booted', 'end')
    sequences = [f.sequence for f in frames]
    report.claim(all(b > a for a, b in zip(sequences, sequences[1:])) and len({f.source for f in frames}) == 1,
                 'numbers of images grow over all openings')


def mistakes_are_survived(run, report, wanted):
    """udev reports a present camera as removed. Another claim covers crashes in the whole run."""
    made = [int(m[9:]) for m in run.marks if m.startswith('mistaken_')]
    silent = [m for m in run.marks if m.startswith('no_frames_after_mistake')]
    report.claim(made == [wanted] and not silent, f'{made} of {wanted} times udev was mistaken, and images came back ({silent[:3]})')


def stops_are_quick(run, report, wanted):
    """Uses systemd's own times: from its SIGTERM to the end of the process."""
    stops = [line.split() for line in run.read('stops').splitlines()]
    for kind in sorted({s[0] for s in stops}):
        took = [(int(s[2]) - int(s[1])) / 1e6 for s in stops if s[0] == kind]
        bad = [s[3:] for s in stops if s[0] == kind and s[3:] != ['success', '0']]
        report.claim(not bad and max(took) <= 5, f'capture is stopped {len(took)} times {kind}, in {min(took):.2f} to {max(took):.2f} s ({bad[:3]})')
    report.claim(len(stops) >= wanted, f'{len(stops)} of {wanted} stops')


def odometry_goes_on(run, report, wanted):
    """Measured like images: from the time at which udev reports the nodes to usable odometry for
    an image taken after the plug."""
    usable = [o for o in run.odometry if o[2] in (1, 2)]
    plugs = [c for c in spans.comebacks(run) if run.marks.get('vio', 0) <= c.plug < run.marks.get('vio_ends', 0)]
    firsts = [next((o[4] for o in usable if o[1] - run.wall >= c.plug and o[4] < c.until), None) for c in plugs]
    own = [first - c.told for c, first in zip(plugs, firsts) if first is not None and c.told is not None]
    report.claim(len(own) == wanted and max(own) <= spans.LIMIT, f'odometry that may be used is back after {len(own)} of {wanted} plugs, '
                 f'{", ".join(f"{o / SECOND:.2f}" for o in own)} s after udev')
    frames = run.between(run.frames, 'vio', 'vio_ends')
    good = {o[0] for o in usable}
    report.claim(sum(f.sequence in good for f in frames) > .9 * len(frames),
                 f'{sum(f.sequence in good for f in frames)} of {len(frames)} images have it, in {len({o[3] for o in usable})} frames of reference')
    report.claim(run.read('restarts_of_vio').strip() == '0', f'vio was started again {run.read("restarts_of_vio").strip()} times')
