-- expect: 20: events[1]: nothing in it changes, time, coordinates, rates or inputs are needed
-- expect: 21: events[2]: nothing in it changes, time, coordinates, rates or inputs are needed
-- expect: 22: events[3]: depends on accelerations, an event has t, q, qd and inputs
-- expect: 23: events[4]: depends on velocities, an impact is where something of positions is zero
-- expect: 24: events[5]: depends on no coordinate, an impact has an impulse along its gradient
-- expect: 25: events[6]: contains inf, finite numbers are needed
-- expect: 25: events[6]: nothing in it changes, time, coordinates, rates or inputs are needed
-- expect: 26: events[7].name: "event 1" is taken by line 20, each event needs its own
-- expect: 27: events[8].inputs.push: depends on accelerations, what an event sets has t, q, qd and inputs
-- expect: 28: events[9].rates.a_x: contains inf, finite numbers are needed
local rd = require "refdyn"
local p = rd.parameters { { "e", 0.5 } }
local push = rd.input("push", 1, "N")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = { "x", "z" }, mass = 1 } },
  points = { A = "a" },
  events = function(s)
    return {
      rd.event { 3 },
      rd.event { p.e },
      rd.event { s.qdd.a_x },
      rd.event { s.points.A.xd, restitution = p.e },
      rd.event { s.t - 1, restitution = 0.5 },
      rd.event { 1 / (s.q.a_z * 0) },
      rd.event { s.q.a_z, name = "event 1" },
      rd.event { s.q.a_z, inputs = { push = s.qdd.a_x } },
      rd.event { s.q.a_z, rates = { a_x = 1 / (s.q.a_z * 0) } },
    }
  end,
}
