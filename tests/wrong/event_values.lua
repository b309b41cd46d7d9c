-- expect: 20: events[1]: constant; must depend on time, coordinates, rates or inputs
-- expect: 21: events[2]: constant; must depend on time, coordinates, rates or inputs
-- expect: 22: events[3]: depends on accelerations; an event may depend on t, q, qd and inputs only
-- expect: 23: events[4]: depends on velocities; an impact needs an expression in positions only
-- expect: 24: events[5]: depends on no coordinate; an impact needs an expression in positions
-- expect: 25: events[6]: contains inf; all numbers must be finite
-- expect: 25: events[6]: constant; must depend on time, coordinates, rates or inputs
-- expect: 26: events[7].name: "event 1" is already taken in line 20; choose another name
-- expect: 27: events[8].inputs.push: depends on accelerations; a value set by an event may depend on t, q, qd and inputs only
-- expect: 28: events[9].rates.a_x: contains inf; all numbers must be finite
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
