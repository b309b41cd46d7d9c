-- expect: 3: string.find: more than the 100 million steps that reading a model may take
local rd = require "refdyn"
local x = string.rep("a", 30):find(("a?"):rep(30) .. ("a"):rep(30) .. "b")
return rd.model { name = "a", links = { { "b", joint = "x", mass = 1 } } }
