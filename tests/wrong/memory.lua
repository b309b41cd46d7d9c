-- expect: 3: string.rep: more than the 100 million steps that reading a model may take
local rd = require "refdyn"
local text = ("x"):rep(2 ^ 32)
