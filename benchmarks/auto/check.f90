! Compare the derivatives that a scene gives to AUTO with central differences, at random states and parameters.
! Linked with one scene instead of AUTO. Arguments: NDIM, NBC, number of parameters. Prints the largest deviation
! of df/du, df/dp, db/du and db/dp, each over the largest entry of its matrix (or one).
program check
   implicit none
   integer, parameter :: dp = kind(1d0)
   real(dp), parameter :: h = 1e-5_dp
   integer :: ndim, nbc, npar, i, sample, icp(20)
   real(dp), allocatable :: u(:), w(:), w0(:), x(:), par(:), p(:), f(:), g(:), fu(:, :), fp(:, :), b(:), c(:), bu(:, :)
   real(dp) :: worst(4)
   character(20) :: word

   call get_command_argument(1, word); read (word, *) ndim
   call get_command_argument(2, word); read (word, *) nbc
   call get_command_argument(3, word); read (word, *) npar
   allocate (u(ndim), w(2*ndim), w0(2*ndim), x(ndim), par(20), p(20), f(ndim), g(ndim), b(nbc), c(nbc))
   allocate (fu(ndim, ndim), fp(ndim, 20), bu(nbc, 2*ndim + 20))
   icp = [(i, i=1, 20)]
   worst = 0
   do sample = 1, 20
      par = 0
      call stpnt(ndim, u, par, 0.3_dp)
      call random_number(x); u = u + x - 0.5_dp
      call random_number(p); par = par + p - 0.5_dp
      call random_number(w0)
      fu = huge(h); fp = huge(h); bu = huge(h)                        ! whatever a scene forgets to set is seen
      call func(ndim, u, icp, par, 2, f, fu, fp)
      call bcnd(ndim, par, icp, nbc, w0(1:ndim), w0(ndim + 1:), b, 2, bu)
      do i = 1, ndim
         x = u; x(i) = u(i) + h; call func(ndim, x, icp, par, 0, f, fu, fp)
         x(i) = u(i) - h; call func(ndim, x, icp, par, 0, g, fu, fp)
         worst(1) = max(worst(1), maxval(abs((f - g)/(2*h) - fu(:, i)))/max(1._dp, maxval(abs(fu))))
      end do
      do i = 1, 2*ndim
         w = w0; w(i) = w0(i) + h; call bcnd(ndim, par, icp, nbc, w(1:ndim), w(ndim + 1:), b, 0, bu)
         w(i) = w0(i) - h; call bcnd(ndim, par, icp, nbc, w(1:ndim), w(ndim + 1:), c, 0, bu)
         worst(3) = max(worst(3), maxval(abs((b - c)/(2*h) - bu(:, i)))/max(1._dp, maxval(abs(bu(:, 1:2*ndim)))))
      end do
      do i = 1, npar
         p = par; p(i) = par(i) + h
         call func(ndim, u, icp, p, 0, f, fu, fp)
         call bcnd(ndim, p, icp, nbc, w0(1:ndim), w0(ndim + 1:), b, 0, bu)
         p(i) = par(i) - h
         call func(ndim, u, icp, p, 0, g, fu, fp)
         call bcnd(ndim, p, icp, nbc, w0(1:ndim), w0(ndim + 1:), c, 0, bu)
         worst(2) = max(worst(2), maxval(abs((f - g)/(2*h) - fp(:, i)))/max(1._dp, maxval(abs(fp(:, 1:npar)))))
         worst(4) = max(worst(4), maxval(abs((b - c)/(2*h) - bu(:, 2*ndim + i))))
      end do
   end do
   print '(4ES11.2)', worst
end program

function getp(code, i, u)
   ! AUTO's, which is not linked here.
   implicit none
   double precision :: getp
   character(*), intent(in) :: code
   integer, intent(in) :: i
   double precision, intent(in) :: u(*)
   getp = 0
end function
