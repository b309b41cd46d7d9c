-- expect: 14: forces[1].at: no point or link "F"; use one of E, a
-- expect: 15: forces[2].value: 2 numbers; must have 3
-- expect: 16: forces[3].axes: no point or link "b"; use one of E, a
-- expect: 17: forces[4].at.on: missing; a point needs it
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  forces = function(s)
    return {
      rd.force { "F", { 0, 0, 1 } },
      rd.force { "E", { 0, 1 } },
      rd.force { "E", { 0, 0, 1 }, axes = "b" },
      rd.force { { at = { 0, 0, 0 } }, { 0, 0, 1 } },
    }
  end,
}
