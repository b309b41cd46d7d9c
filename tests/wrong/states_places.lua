-- expect: 12: states[1].rate: depends on accelerations; a rate may depend on t, q, qd and inputs only
-- expect: 13: forces[1]: an energy may depend on coordinates and positions only; write such forces as rd.force or forces on coordinates
-- expect: 16: constraints[1]: depends on a state; rows may depend on t, coordinates, points and inputs only
-- expect: 17: constraints[2]: depends on a state; rows may depend on t, coordinates, points and inputs only
-- expect: 18: constraints[3]: depends on a state; an impact needs an expression in positions only
-- expect: 22: events[1]: depends on a state; an impact needs an expression in positions only
-- expect: 22: events[2].states.z: depends on accelerations; a value set by an event may depend on t, q, qd and inputs only
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 }, { "b", joint = "y", mass = 1 } },
  states = function(s) return { rd.state { "z", rate = s.qdd.a_x }, rd.state { "w", rate = s.states.z } } end,
  forces = function(s) return { rd.energy { s.states.z * s.q.a_x }, a_x = s.states.z } end,
  constraints = function(s)
    return {
      rd.position { s.q.a_x - s.states.z },
      rd.velocity { s.qd.b_y - s.states.w },
      rd.contact { s.q.b_y + s.states.w },
    }
  end,
  events = function(s)
    return { rd.event { s.q.a_x - s.states.z, restitution = 1 }, rd.event { s.t - 1, states = { z = s.qdd.a_x } } }
  end,
}
