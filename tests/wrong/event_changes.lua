-- expect: 16: events[1].rates.a_y: unknown coordinate; did you mean "a_x"?
-- expect: 16: events[1].inputs.pusch: unknown input; did you mean "push"?
-- expect: 16: events[1].parameters.f: unknown parameter; use e
-- expect: 17: events[2].rates: has entries without a name; must be a table of values by name such as { arm_psi = 0 }
-- expect: 18: events[3].inputs.push: a text; must be a number or an expression
-- expect: 19: events[4].rates: a number; must be a table of values by name such as { arm_psi = 0 }
local rd = require "refdyn"
local p = rd.parameters { { "e", 0.5 } }
local push = rd.input("push", 1, "N")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = { "x", "z" }, mass = 1 } },
  points = { A = "a" },
  events = function(s)
    return {
      rd.event { s.q.a_z, rates = { a_y = 0 }, inputs = { pusch = 0 }, parameters = { f = 1 } },
      rd.event { s.q.a_z, rates = { 1 } },
      rd.event { s.q.a_z, inputs = { push = "left" } },
      rd.event { s.q.a_z, rates = 3 },
    }
  end,
}
