-- expect: 14: rd.shaper.frequency: missing; a shaper needs it
-- expect: 15: rd.shaper.course: depends on the state or on inputs; must be a course in time
-- expect: 16: rd.shaper.kind: "zvv" is no shaper; did you mean "zv"?
-- expect: 17: rd.shaper.damping: value 0.4; must be at most 0.3 with kind "ei"
-- expect: 18: rd.shaper.frequency: value 0; must be positive
-- expect: 19: rd.shaper.damping: value 1.5; must be from 0 to 1
local rd = require "refdyn"
local p = rd.parameters { { "v", 0.5, "m/s" }, { "z", 0.4, "1" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1, spring = { x = 1 } } },
  courses = function(s)
    return {
      a = rd.shaper { rd.ramp(s.t, 0, 1) },
      b = rd.shaper { s.q.a_x, frequency = 2 },
      c = rd.shaper { rd.ramp(s.t, 0, 1), frequency = 2, kind = "zvv" },
      d = rd.shaper { rd.ramp(s.t, 0, 1), frequency = 2, kind = "ei", damping = p.z },
      e = rd.shaper { rd.ramp(s.t, 0, 1), frequency = 0 },
      f = rd.shaper { rd.ramp(s.t, 0, 1), frequency = 2, damping = 1.5 },
    }
  end,
}
