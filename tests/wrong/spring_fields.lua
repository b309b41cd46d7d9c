-- expect: 14: forces[1].stifness: unknown field; did you mean "stiffness"?
-- expect: 15: forces[2].to: missing; a spring needs it
-- expect: 15: forces[2].stiffness: value -1; must not be negative
-- expect: 16: forces[3]: both ends are on one link; put them on two links
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  forces = function(s)
    return {
      rd.spring { "E", "ground", stifness = 10 },
      rd.spring { "E", stiffness = -1 },
      rd.damper { "E", { on = "a", at = { 1, 0, 0 } }, damping = 1 },
    }
  end,
}
