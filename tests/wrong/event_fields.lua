-- expect: 17: events[1].direction: "left"; must be "down", "up" or "both"
-- expect: 18: events[2].direction: "both", but an impact comes from one side; must be "down" or "up"
-- expect: 19: events[3].ends: a number; must be true or false
-- expect: 20: events[4].restitution: given together with rates; give one of them
-- expect: 21: events[5].restitution: value -1; must not be negative
-- expect: 22: events[6]: made by rd.position; must be rd.event { ... } or rd.sampled { ... }
-- expect: 23: events[7].value: missing; rd.event needs it
local rd = require "refdyn"
local p = rd.parameters { { "e", 0.5 } }
local push = rd.input("push", 1, "N")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = { "x", "z" }, mass = 1 } },
  points = { A = "a" },
  events = function(s)
    return {
      rd.event { s.q.a_z, direction = "left" },
      rd.event { s.q.a_z, direction = "both", restitution = 1 },
      rd.event { s.q.a_z, ends = 1 },
      rd.event { s.q.a_z, restitution = 1, rates = { a_x = 0 } },
      rd.event { s.q.a_z, restitution = -1 },
      rd.position { s.q.a_z },
      rd.event { direction = "up" },
    }
  end,
}
