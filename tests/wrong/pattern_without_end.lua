-- expect: 3: string.find: too much work for a model, a loop has no end or a pattern too many repetitions?
local rd = require "refdyn"
local x = string.rep("a", 30):find(("a?"):rep(30) .. ("a"):rep(30) .. "b")
return rd.model { name = "a", links = { { "b", joint = "x", mass = 1 } } }
