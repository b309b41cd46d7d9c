-- expect: 8: links[1].name: given twice, by name and as item 1, once is enough
-- expect: 9: mass: given twice in one table, the first time in line 9
-- expect: 10: item 1: given twice in one table, the first time in line 10
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
