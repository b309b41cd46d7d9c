-- expect: 15: constraints[1].joint: "psi" makes more than three turns; for three turns use ball alone
-- expect: 16: constraints[2].joint: "weld" leaves nothing free; use it alone
-- expect: 17: constraints[3].joint: leaves all motions free; remove some of them
-- expect: 18: constraints[4].joint: "ball" makes more than three turns; for three turns use ball alone
-- expect: 19: constraints[5].joint: has named entries (x); must be a list of names such as { "a", "b" }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  constraints = function(s)
    return {
      rd.close { "arm", "hand", joint = { "ball", "psi" } },
      rd.close { "arm", "hand", joint = { "weld", "x" } },
      rd.close { "arm", "hand", joint = { "x", "y", "z", "ball" } },
      rd.close { "arm", "hand", joint = { "psi", "ball" } },
      rd.close { "arm", "hand", joint = { x = 1 } },
    }
  end,
}
