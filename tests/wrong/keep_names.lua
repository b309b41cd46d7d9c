-- expect: 14: constraints[1].keep[2]: "x" is given twice; give it once
-- expect: 15: constraints[2].keep: empty; name x, y, z or some of them
-- expect: 16: constraints[3].keep: has named entries (x); must be a list of names such as { "a", "b" }
-- expect: 17: constraints[4].keep: "x,,y" has an empty name; write names with commas between them
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  constraints = function(s)
    return {
      rd.loop { "arm", "hand", keep = "x,x" },
      rd.loop { "arm", "hand", keep = {} },
      rd.loop { "arm", "hand", keep = { x = true } },
      rd.loop { "arm", "hand", keep = "x,,y" },
    }
  end,
}
