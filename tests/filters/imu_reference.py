"""The inertial filter in plain NumPy: F, Q and H as matrices. Not here: faults, new fields, orientations, smoothing."""

from types import SimpleNamespace

import numpy as np
from scipy.spatial.transform import Rotation

from bingham import ImuFilter
from bingham.kernels import imu_loop as loop
from bingham.kernels import imu_model as model

UP, turn = np.array([0.0, 0.0, 1.0]), Rotation.from_rotvec
THETA, VELOCITY, BIAS, FORCE_BIAS = slice(0, 3), slice(3, 5), slice(5, 8), slice(8, 11)
VECTORS = "v b a mean_force swing slow_swing slow_turn last_field"
STARTED = "unknown_heading swing_power speed_power bias_scale level"
ZEROS = """drift_expected level_time surprise contradiction age quiet force_deviation rest_refused north up weight
    residual_mean residual_variance lost_bias resting rest_seen"""
FALL, NO_HEADING = np.eye(11)[[1, 0]] * [[1.0], [-1.0]], np.where(np.arange(11) == 2, 0.0, 1.0)


class Reference:
    def __init__(self, filter: ImuFilter, t, rate, force) -> None:
        start = filter.start(force).record
        self.par, self.P = filter, start["covariance"]
        self.q = Rotation.from_quat(start["orientation"], scalar_first=True)
        self.t, self.force_t, self.rate, self.slow_rate, self.force, self.slow_force = t, t, rate, rate, force, force
        self.__dict__ |= {name: float(start[name]) for name in STARTED.split()}
        self.__dict__ |= dict.fromkeys(VECTORS.split(), np.zeros(3)) | dict.fromkeys(ZEROS.split(), 0.0)
        self.turned, self.drift, self.ending, self.noise = np.zeros((3, 3)), np.zeros(2), np.zeros((2, 2)), 1.0
        self.clear()

    def clear(self) -> None:
        zeros = dict.fromkeys(("dt", "travel", "shake", "force_time"), 0.0)
        zeros |= dict.fromkeys(("rotated", "raw", "impulse"), np.zeros(3))
        self.sum = SimpleNamespace(**zeros, C=np.zeros((3, 3)), field=[])

    def gyroscope(self, t, rate) -> None:
        dt, self.t, self.rate = t - self.t, t, rate
        self.age += dt
        gain = max(1.0 - np.exp(-dt / loop.QUIET_TIME), min(1.0, dt / self.age))
        self.slow_rate = self.slow_rate + gain * (rate - self.slow_rate)
        self.quiet = self.quiet + dt if np.sum((rate - self.slow_rate) ** 2) <= self.par.rest_rate**2 else 0.0
        self.resting = self.quiet >= self.par.rest_time and self.force_deviation <= self.par.rest_acceleration**2
        s, w, self.q = self.sum, (rate - self.b) * dt, self.q * turn((rate - self.b) * dt)
        s.dt, s.C, s.rotated = s.dt + dt, s.C + self.q.as_matrix() * dt, s.rotated + self.q.apply(w)
        s.raw, s.travel = s.raw + rate * dt, s.travel + np.linalg.norm(w)

    def accelerometer(self, t, force) -> None:
        dt, self.force_t, self.force = t - self.force_t, t, force
        gain = max(1.0 - np.exp(-dt / loop.QUIET_TIME), min(1.0, dt / max(self.age, 1e-9)))
        self.slow_force = self.slow_force + gain * (force - self.slow_force)
        self.force_deviation = np.sum((force - self.slow_force) ** 2)
        if self.force_deviation > self.par.rest_acceleration**2:
            self.quiet, self.resting = 0.0, False
        step = (self.q.apply(force - self.a) - self.par.gravity * UP) * dt
        self.v, s = self.v + step * [1.0, 1.0, 0.0], self.sum
        s.impulse, s.force_time = s.impulse + step, s.force_time + dt
        s.shake += max(0.0, force @ force - self.par.gravity**2) * dt

    def magnetometer(self, field) -> None:
        if np.any(field != self.last_field):
            self.sum.field.append(self.q.apply(field))
            self.last_field = field

    def condition(self, H, innovation, variance, moves=None) -> None:
        """Joseph's form, for the optimal gain times `moves`."""
        s = H @ self.P @ H + variance
        k = (np.ones(11) if moves is None else moves) * (self.P @ H) / s
        self.x = self.x + k * (innovation - H @ self.x)
        left = np.eye(11) - np.outer(k, H)
        self.P = left @ self.P @ left.T + variance * np.outer(k, k)

    def update(self) -> None:
        s, par, dt = self.sum, self.par, self.sum.dt
        if s.field:
            self.P[2, 2], self.unknown_heading = self.P[2, 2] + self.unknown_heading, 0.0
        F, Q = np.eye(11), np.zeros((11, 11))
        F[THETA, BIAS], F[VELOCITY, FORCE_BIAS] = -s.C, -s.C[:2]
        F[VELOCITY] += par.gravity * dt * FALL
        F[VELOCITY, BIAS] = (np.cross(s.C, self.v, axis=0) + 0.5 * par.gravity * dt * np.cross(UP, s.C, axis=0))[:2]
        self.slow_turn = self.slow_turn + min(1.0, dt / model.SCALE_TIME) * (s.rotated / dt - self.slow_turn)
        net = 2.0 * model.SCALE_TIME * (self.slow_turn @ self.slow_turn) * dt + model.CORRELATION_TURN * s.travel
        theta = par.gyroscope_noise**2 * dt + par.gyroscope_scale_error**2 * net
        shake = par.accelerometer_scale_error**2 * model.CORRELATION_TIME * s.shake
        Q[THETA, THETA] = theta * np.diag([self.noise, self.noise, 1.0])
        Q[VELOCITY, VELOCITY] = (par.accelerometer_noise**2 * dt + shake) * np.eye(2)
        Q[BIAS, BIAS] = (par.gyroscope_bias_walk**2 * dt + self.lost_bias) * np.eye(3)
        Q[FORCE_BIAS, FORCE_BIAS] = 1e-8 * dt * np.eye(3)
        self.lost_bias, self.P, self.x = 0.0, F @ self.P @ F.T + Q, np.zeros(11)
        before = self.P
        self.turned = self.turned + np.outer(s.C[2] / dt, s.raw - self.b * dt)
        at_rest = self.resting and self.rest_is_believed()
        if s.force_time > 0.0:
            speed2 = self.speed_variance()
            ratio = 0.5 * np.sum(self.v[:2] ** 2 / (np.diag(self.P)[3:5] + self.swing_power + par.slow_velocity**2))
            self.contradiction += min(1.0, s.force_time / model.CONTRADICTION_TIME) * (ratio - self.contradiction)
            variance = model.REST_SPEED**2 if at_rest else 2.0 * model.SWING_TIME * speed2
            seen = [(np.eye(11)[VELOCITY], self.v, variance)]
            if not at_rest:
                seen.insert(0, (par.gravity * FALL, s.impulse / s.force_time, self.last2 / model.ACCELERATION_TIME))
            for rows, values, variance in seen:
                for H, value in zip(rows, values[:2], strict=True):
                    self.condition(H, -value, variance / s.force_time, NO_HEADING)
        if at_rest:
            self.rest_seen = True
            for H, rate, b in zip(np.eye(11)[BIAS], s.raw / dt, self.b, strict=True):
                self.condition(H, rate - b, 0.3 * par.rest_rate_error**2 / dt)
        if s.field:
            self.heading(np.mean(s.field, axis=0), dt)
        if s.force_time > 0.0:
            self.watch(before, dt)
        self.q = turn(self.x[THETA]) * self.q
        self.v = (self.v + np.cross(self.x[THETA], self.v) + [*self.x[VELOCITY], 0.0]) * [1.0, 1.0, 0.0]
        self.b = np.clip(self.b + self.x[BIAS], -model.MAXIMAL_BIAS, model.MAXIMAL_BIAS)
        self.a = np.clip(self.a + self.x[FORCE_BIAS], -model.MAXIMAL_FORCE_BIAS, model.MAXIMAL_FORCE_BIAS)
        self.ending = self.P[:2, VELOCITY] @ np.linalg.inv(self.P[VELOCITY, VELOCITY] + self.last2 * np.eye(2))
        largest = np.abs(self.b).max()
        if not self.rest_seen and largest > model.BEYOND_PRIOR * self.bias_scale:
            self.lost_bias, self.bias_scale = self.lost_bias + largest**2 - self.bias_scale**2, largest
        self.clear()

    def rest_is_believed(self) -> bool:
        s, par = self.sum, self.par
        if np.any(np.abs(s.raw) > model.MAXIMAL_BIAS * s.dt):
            return False
        allowed = model.LIMIT * (np.diag(self.P)[BIAS] + par.rest_rate_error**2)
        believed = bool(np.all((s.raw / s.dt - self.b) ** 2 <= allowed))
        self.rest_refused = 0.0 if believed else self.rest_refused + s.dt
        steady = not believed and np.any((self.slow_rate - self.b) ** 2 > allowed)
        if steady and (not self.rest_seen or self.rest_refused >= model.LASTING_REST):
            self.lost_bias, self.rest_refused = self.lost_bias + par.gyroscope_wide_bias**2, 0.0
        return believed

    def speed_variance(self) -> float:
        s, dt = self.sum, self.sum.force_time
        gain, force = min(1.0, dt / self.par.motion_window), s.impulse / dt
        self.mean_force = self.mean_force + gain * (force - self.mean_force)
        self.swing = self.swing + (force - self.mean_force) * dt - gain * self.swing
        self.slow_swing = self.slow_swing + min(1.0, dt / model.SWING_TIME) * (self.swing - self.slow_swing)
        if self.P[0, 0] + self.P[1, 1] < model.DOUBTFUL_TILT:
            slow2, whole2 = (min(v @ v / 3.0, model.MAXIMAL_SPEED**2) for v in (self.slow_swing, self.swing))
            self.swing_power += gain * (slow2 - self.swing_power)
            self.speed_power += gain * (whole2 - self.speed_power)
        fast = (self.age > self.par.motion_window) / model.FAST**4
        slow, whole = (x + fast * x**3 for x in (self.swing_power, self.speed_power))
        self.last2 = 2.0 * (whole + self.par.slow_velocity**2)
        return slow + self.par.slow_velocity**2

    def watch(self, before, dt) -> None:
        leak, tilt = np.exp(-dt / model.DRIFT_TIME), before[0, 0] + before[1, 1]
        self.drift = leak * self.drift + self.x[:2] / np.sqrt(tilt)
        self.drift_expected *= leak**2
        self.drift_expected += max(1.0 - (self.P[0, 0] + self.P[1, 1]) / tilt, 1e-9)
        if not self.resting:
            ratio = self.drift @ self.drift / self.drift_expected
            self.surprise, most = ratio, min(ratio, model.MAXIMAL_RATIO)
            self.noise = np.clip(self.noise * np.exp(dt / model.ADAPT_TIME * (most - 1.0)), 1.0, model.MAXIMAL_NOISE)
            self.level_time = min(max(self.level_time, 5.0) + dt, model.LEVEL_TIME)
            self.level += dt / self.level_time * (most - self.level)

    def heading(self, field, dt) -> None:
        par, (east, north, up) = self.par, field
        horizontal = np.hypot(east, north)
        if self.weight == 0.0:
            self.north, self.up = horizontal, up
        visible2 = (horizontal - self.north) ** 2 + (up - self.up) ** 2
        hidden2 = 0.5 * visible2 / min(horizontal, self.north) ** 2
        variance = par.magnetometer_error**2 + hidden2
        weight = par.magnetometer_error**2 / variance
        self.weight += dt * weight
        rate = max(dt / par.field_memory, dt / max(self.weight, dt)) * weight
        self.north, self.up = self.north + rate * (horizontal - self.north), self.up + rate * (up - self.up)
        bearing = np.arctan2(east, north)
        H = np.array([-up / horizontal * np.sin(bearing), -up / horizontal * np.cos(bearing), 1.0, *np.zeros(8)])
        residual = bearing - par.declination - H @ self.x
        residual -= 2.0 * np.pi * np.floor(residual / (2.0 * np.pi) + 0.5)
        predicted = H @ self.P @ H
        assert hidden2 <= par.field_limit**2 and residual**2 <= model.HEADING_LIMIT * (predicted + variance), "a fault"
        if predicted < model.UNKNOWN_HEADING:
            gain, change = min(1.0, dt / model.RESIDUAL_TIME), residual - self.residual_mean
            self.residual_mean += gain * change
            self.residual_variance = (1.0 - gain) * (self.residual_variance + gain * change**2)
            variance = variance * (model.REST_LASTS if self.resting else 1.0)
            variance = 2.0 * par.magnetometer_time / dt * (variance + model.RESIDUAL_SHARE * self.residual_variance)
        concentration = 0.5 / np.sinh(0.5 * min(predicted, 40.0))
        move = np.arctan2(np.sin(residual), concentration * variance + np.cos(residual))
        moves = 1.0 * np.isin(np.arange(11), [2, 5, 6, 7])
        self.condition(H, move * (predicted + variance) / predicted + H @ self.x, variance, moves)

    def report(self):
        par, w = self.par, self.rate - self.b
        q = Rotation.from_quat([*(-0.5 * self.ending @ self.v[:2]), 0.0, 1.0]) * self.q * turn(w * par.gyroscope_delay)
        lag = loop.DELAY_SHARE * par.gyroscope_delay * q.apply(w)
        tilted2 = np.sum((par.alignment_error * self.force / par.gravity) ** 2)
        extra = np.outer(lag, lag) + np.diag([tilted2, tilted2, 0.0])
        extra[2, 2] += self.unknown_heading + self.residual_mean**2 + model.RESIDUAL_SHARE * self.residual_variance
        extra[2, 2] += par.gyroscope_scale_error**2 * np.sum(self.turned**2) * (self.unknown_heading > 0.0)
        extra[2, 2] += (loop.NORTH_SHARE * par.magnetometer_error) ** 2 * (self.weight > 0.0)
        scale = np.sqrt([max(self.level, loop.LEVEL_FLOOR, min(self.surprise, loop.MAXIMAL_SURPRISE))] * 2 + [1.0])
        return q.as_quat(scalar_first=True), scale[:, None] * self.P[:3, :3] * scale + extra
