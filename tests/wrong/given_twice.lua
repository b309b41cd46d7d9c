-- expect: 8: links[1].name: given by name and as item 1; give it once
-- expect: 9: mass: already given in line 9 of this table; give it once
-- expect: 10: item 1: already given in line 10 of this table; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", name = "b", joint = "z", mass = 1 },
    { "c", joint = "z", mass = 1, ["mass"] = 2 },
    { "d", joint = "z", mass = 1, [1] = "e" },
  },
  forces = function(s)
    return {
      rd.spring { "a", "ground", to = "c", stiffness = 1 },
    }
  end,
}
