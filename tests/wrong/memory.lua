-- expect: 3: string.rep: more work than the 100 million steps that a model may take while it is read
local rd = require "refdyn"
local text = ("x"):rep(2 ^ 32)
