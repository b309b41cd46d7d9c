-- expect: 3: string.find: more work than the 100 million steps that a model may take while it is read
local rd = require "refdyn"
local x = string.rep("a", 30):find(("a?"):rep(30) .. ("a"):rep(30) .. "b")
return rd.model { name = "a", links = { { "b", joint = "x", mass = 1 } } }
