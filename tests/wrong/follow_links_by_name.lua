-- expect: 4: links: has named entries (arm, hand); must be a list of tables
local rd = require "refdyn"
return rd.model { name = "wrong",
  links = { arm = { joint = "z", mass = 1 }, hand = { on = "arm", mass = 1 } },
  points = { E = "hand" },
}
